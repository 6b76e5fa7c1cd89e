"""What a job costs: seconds and memory, by jobs of the full study that were measured.

`config/reference/job_costs.csv` holds the measured jobs; `job_costs_tiny.csv` beside it those of
the study `tiny`, for the time that is left of its run. A kind of job is an experiment's name, or
``table``, ``figure`` or ``paper``. The seconds of a kind are a + b W + c S with numbers that are
not negative, where W counts projections (elements x frames x iterations) and S positions (vertices
x frames) of the job's scene, in millions, times a factor of the method where jobs of several
methods were measured; the memory is a + c S. Kinds without a scene cost what they were measured to
cost, and one that was not measured costs as much as the dearest that was.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import nnls

from pdrom.core.store import read_table
from pdrom.model.scene import Scene

MEASURED = Path("config/reference/job_costs.csv")
COLUMNS = [
    "kind", "method", "elements", "vertices", "frames", "iterations", "seconds", "memory_mb",
]  # fmt: skip

# A request leaves at least this much room above the prediction, for slower machines.
ROOM = 2.0
# What stands above a job on a node: two processes of Snakemake, each of which makes the plan, and
# the process that jobs are forked from. Seconds until a job begins on a busy node, memory in MB.
ABOVE_SECONDS = 60.0
ABOVE_MB = 1000
STEP_MB = 250


@dataclass(frozen=True)
class Size:
    """What the cost of a job grows with: elements of all constraint groups, vertices, frames.

    ``dimension`` is that of the mesh, 2 or 3.
    """

    elements: float
    vertices: float
    frames: float
    iterations: float
    dimension: int = 2

    @classmethod
    def of(cls, scene: Scene) -> "Size":
        """Size of a scene."""
        config, mesh = scene.config, scene.mesh
        elements = sum(group.elements for group in scene.groups)
        dimension = 3 if len(mesh.tetrahedra) else 2
        return cls(elements, mesh.vertices, config.frames, config.iterations, dimension)

    @property
    def projections(self) -> float:
        """Projections of a full-order run, in millions."""
        return self.elements * self.frames * self.iterations * 1e-6

    @property
    def positions(self) -> float:
        """Positions of vertices that a full-order run stores, in millions."""
        return self.vertices * self.frames * 1e-6

    def refined(self, factor: float) -> "Size":
        """The same scene with ``factor`` times the vertices along each of its sides."""
        times = factor**self.dimension
        return replace(self, elements=self.elements * times, vertices=self.vertices * times)


@dataclass(frozen=True)
class Cost:
    """Seconds of processor time and megabytes of memory of a job."""

    seconds: float
    memory_mb: float


@dataclass(frozen=True)
class Request:
    """Whole minutes and megabytes that a job asks a cluster for."""

    minutes: int
    memory_mb: int


@dataclass(frozen=True)
class _Kind:
    """Fitted cost of a kind of job.

    seconds : a, b, c of the module's formula
    memory : a, 0, c of the module's formula, in MB
    methods : factor of each method that was measured
    room : largest quotient of measured and predicted seconds
    """

    seconds: np.ndarray
    memory: np.ndarray
    methods: dict[str, float] = field(default_factory=dict)
    room: float = 1.0

    def cost(self, size: Size | None, method: str | None = None) -> Cost:
        features = _features(size)
        factor = self.methods.get(method or "", max(self.methods.values(), default=1.0))
        return Cost(float(features @ self.seconds) * factor, float(features @ self.memory))


class CostModel:
    """Predicted costs by kind of job, fitted to measured ones; see the module.

    Parameters
    ----------
    measured : jobs with the columns `COLUMNS`; sizes are missing where a job has no scene,
        ``memory_mb`` where it was not measured
    """

    def __init__(self, measured: pd.DataFrame) -> None:
        self.measured = measured

    @classmethod
    def load(cls, root: Path) -> "CostModel":
        """Model of the measured jobs of the project in ``root``; StorageError if unreadable."""
        return cls(read_table(root / MEASURED, COLUMNS, result=False))

    @classmethod
    def of_study(cls, root: Path, results: str) -> "CostModel":
        """Model of the study with that results folder, where its jobs were measured; else `load`.

        Its seconds are those of processor time, which a busy machine does not stretch.
        """
        own = (root / MEASURED).with_name(f"{MEASURED.stem}_{Path(results).name}.csv")
        return cls(read_table(own, COLUMNS, result=False)) if own.is_file() else cls.load(root)

    @cached_property
    def _kinds(self) -> dict[str, _Kind]:
        memory = self.measured.memory_mb.max()
        return {str(kind): _fitted(jobs, memory) for kind, jobs in self.measured.groupby("kind")}

    def cost(self, kind: str, size: Size | None = None, method: str | None = None) -> Cost:
        """Expected cost of a job; of the dearest kind if this one was not measured.

        ``size`` is that of the job's scene. A method that was not measured counts as the dearest.
        """
        found = [self._kinds[kind]] if kind in self._kinds else list(self._kinds.values())
        costs = [one.cost(size, method) for one in found]
        return Cost(max(c.seconds for c in costs), max(c.memory_mb for c in costs))

    def request(self, kind: str, size: Size | None = None, method: str | None = None) -> Request:
        """What to ask for, so that every measured job would have had `ROOM` times its time.

        In a batch each layer of jobs brings the room for what stands above one.
        """
        expected = self.cost(kind, size, method)
        room = ROOM * (self._kinds[kind].room if kind in self._kinds else 1.0)
        memory = ABOVE_MB + ROOM * expected.memory_mb
        return Request(
            minutes=math.ceil((ABOVE_SECONDS + room * expected.seconds) / 60.0),
            memory_mb=math.ceil(memory / STEP_MB) * STEP_MB,
        )


def _size(job: object) -> Size:
    return Size(*(getattr(job, name) for name in ("elements", "vertices", "frames", "iterations")))


def _features(size: Size | None) -> np.ndarray:
    """1, W and S, or (1, 0, 0) without a scene."""
    if size is None:
        return np.array([1.0, 0.0, 0.0])
    return np.array([1.0, size.projections, size.positions])


def _fitted(jobs: pd.DataFrame, memory: float) -> _Kind:
    """Fit of one kind; ``memory`` (MB) is taken where none of its jobs has a measured one."""
    sized = bool(jobs.elements.notna().all())
    features = np.array([_features(_size(job) if sized else None) for job in jobs.itertuples()])
    seconds = jobs.seconds.to_numpy(dtype=float)
    plain = _Kind(_relative(features, seconds), _memory(features, jobs, memory))
    named = jobs.method.notna().to_numpy()
    predicted = features @ plain.seconds
    methods = {
        str(name): float(np.median((seconds / predicted)[named & (jobs.method == name).to_numpy()]))
        for name in sorted(jobs.method[named].unique())
    }
    factors = np.array([methods.get(name, 1.0) for name in jobs.method])
    room = float((seconds / (predicted * factors)).max())
    return _Kind(plain.seconds, plain.memory, methods, max(room, 1.0))


def _relative(features: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Coefficients >= 0 of least relative errors, scaled so that half the values lie above."""
    found, _ = nnls(features / values[:, None], np.ones(len(values)))
    return found * np.median(values / (features @ found))


def _memory(features: np.ndarray, jobs: pd.DataFrame, largest: float) -> np.ndarray:
    """Coefficients of the memory, scaled so that no measured value lies above."""
    known = jobs.memory_mb.notna().to_numpy()
    if not known.any():
        return np.array([largest, 0.0, 0.0])
    values = jobs.memory_mb.to_numpy(dtype=float)[known]
    kept = features[known] * [1.0, 0.0, 1.0]
    found, _ = nnls(kept / values[:, None], np.ones(len(values)))
    return found * np.max(values / (kept @ found))
