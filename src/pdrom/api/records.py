"""Full-order and reduced runs, their errors, and their arrays in a file."""

from dataclasses import dataclass, field, is_dataclass
from functools import cache, reduce
from typing import Annotated, Any, cast, get_type_hints

import h5py
import numpy as np
from pydantic import ConfigDict, Field, InstanceOf, create_model

from pdrom.core.errors import ConfigurationError, SnapshotError
from pdrom.core.packed import brief
from pdrom.core.store import require_finite
from pdrom.core.yamlfile import shown, validate
from pdrom.model.effects.base import held_vertices
from pdrom.model.mesh.types import store_mesh
from pdrom.model.metrics import deformation_error, trajectory_error
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import displacement_norms, mean_motion


def require_types(record: Any) -> None:
    """Raise ConfigurationError if a field of the dataclass ``record`` lacks its declared type."""
    kind: Any = type(record)
    validate(_strict(kind), vars(record), kind.__name__)


@cache
def _strict(kind: type) -> Any:
    hints, instance = get_type_hints(kind, include_extras=True), cast(Any, InstanceOf)
    fields: Any = {n: (instance[h] if is_dataclass(h) else h, ...) for n, h in hints.items()}
    strict = ConfigDict(strict=True, arbitrary_types_allowed=True)
    return create_model(kind.__name__, __config__=strict, **fields)


@dataclass(frozen=True, eq=False)
class Snapshots:
    """n training snapshots of a group of e elements with p rows.

    p : (n, e p, 3) projections in the last local step of the ``frames`` (n,)
    roundoff : (n,) norm of the rounding errors of p
    """

    p: np.ndarray
    roundoff: np.ndarray
    frames: np.ndarray

    __repr__ = brief

    def __post_init__(self) -> None:
        require_types(self)


FULL, FULL_MODEL = "full order", "full-order model"  # in files; in words
STILL = 1e-6  # nothing moves if no coordinate changes by more than this fraction of the extent


@dataclass(frozen=True)
class Errors:
    """Errors of a run against the run that ``reference`` names.

    position : position error, relative to displacements of the reference; None if nothing moves
    deformation : see `pdrom.model.metrics.deformation_error`; None for a rigid body
    """

    position: float | None
    deformation: float | None
    reference: str

    def __str__(self) -> str:
        shown = ["none" if e is None else f"{e:.2g}" for e in (self.position, self.deformation)]
        errors = f"relative errors {shown[0]} (positions) and {shown[1]} (deformation)"
        return f"{errors} against {self.reference}"


@dataclass(frozen=True, eq=False)
class Run:
    """Run of a scene with the full-order model or a reduced model.

    positions : (F' + 1, N, 3) m; entry 0 is the initial state; F' < F if the run blew up
    ms : (F',) milliseconds of each frame, with the positions of all vertices
    snapshots : name of each constraint group -> its training snapshots; empty for a reduced run
    method : `FULL`, or the title of the model that computed the run
    blowup_frame : first frame that blew up; None if no frame did
    frame_error : (F,) estimated error of each frame, NaN if not estimated; None without estimates
    """

    scene: Scene
    positions: np.ndarray
    ms: np.ndarray
    snapshots: dict[str, InstanceOf[Snapshots]] = field(default_factory=dict)
    method: Annotated[str, Field(pattern=r"^\P{C}+$")] = FULL
    blowup_frame: Annotated[int, Field(ge=0)] | None = None
    frame_error: np.ndarray | None = None

    def __post_init__(self) -> None:
        require_types(self)
        frames, vertices = self.scene.config.frames, self.scene.mesh.vertices
        ended, done = self.blowup_frame, self.ms.size
        if done != frames if ended is None else done - ended not in (0, 1) or ended >= frames:
            raise SnapshotError(f"{done} of {frames} frames, blow-up in frame {shown(ended, 60)}")
        arrays = {"positions": (self.positions, (done + 1, vertices, 3)), "ms": (self.ms, (done,))}
        if self.frame_error is not None:
            arrays["frame_error"] = self.frame_error, (frames,)
        for name, own in self.snapshots.items():
            group, count, at = self.scene.group(name), own.roundoff.size, own.frames
            whole = at.shape == (count,) and at.dtype.kind in "iu"
            if not whole or (np.diff(at, prepend=-1, append=frames) <= 0).any():
                fault = f"frames {shown(at.tolist(), 60)} of {frames}"
                raise SnapshotError(f"snapshots of {name}: {fault}")
            rows = group.elements * group.rows_per_element
            arrays[f"snapshots of {name}"] = own.p, (count, rows, 3)
            arrays[f"rounding errors of {name}"] = own.roundoff, (count,)
        for name, (array, shape) in arrays.items():
            known = array.dtype in (np.float32, np.float64) and not np.ma.isMaskedArray(array)
            if array.shape != shape or not known:
                fault = f"of {array.dtype} {array.shape}, required: float {shape}"
                raise SnapshotError(f"{name} {fault}")

    def __repr__(self) -> str:
        held = f"snapshots of {', '.join(self.snapshots)}" if self.snapshots else "no snapshots"
        speed = f"{np.median(self.ms):.3g} ms a frame" if len(self.ms) else "no frame"
        ended = "" if self.blowup_frame is None else f", blew up in frame {self.blowup_frame}"
        return f"Run({self.scene!r}, {self.method}, {speed}, {held}{ended})"

    @property
    def full_order(self) -> bool:
        """Whether the full-order model computed the run."""
        return self.method.startswith(FULL)

    @property
    def title(self) -> str:
        """Description of the run in messages and of references."""
        config, asked = self.scene.config, self.scene.config.iterations
        title = f"the run of '{config.name}' by {self.method.replace(FULL, f'the {FULL_MODEL}')}"
        if self.method != FULL:
            return title
        if isinstance(asked, int):
            return f"{title}, {asked} iterations a frame"
        return f"{title}, frame errors of {asked.error}"

    def require_finite(self, name: str) -> None:
        """Raise SnapshotError, naming the run ``name``, if it has NaN or infinite numbers."""
        arrays = {"positions": self.positions, "ms": self.ms}
        for group, own in self.snapshots.items():
            arrays |= {f"snapshots of {group}": own.p, f"rounding errors of {group}": own.roundoff}
        for array, values in arrays.items():
            require_finite(f"{name}: {array}", values, SnapshotError)

    def error(self, reference: "Run") -> Errors:
        """Compute position and deformation error against ``reference``, over all frames.

        Both errors are None if one of the runs blew up. ConfigurationError if ``reference`` has
        another mesh, time step or number of frames.
        """
        self.require_comparable(reference)
        if self.blowup_frame is not None or reference.blowup_frame is not None:
            return Errors(None, None, reference.title)
        if still := standstill(reference.scene, reference.positions):
            return Errors(None, None, f"{reference.title}; {still}")
        moved, other = self.positions[1:], reference.positions[1:]
        rest, masses = self.scene.mesh.points, reference.scene.masses
        distance, moved_by = self.differences(reference), displacement_norms(reference.positions)
        shape = deformation_error(moved, other, rest, masses)
        return Errors(trajectory_error(distance, moved_by), shape, reference.title)

    def errors(self, reference: "Run") -> np.ndarray:
        """Compute position errors (F',), relative to the RMS displacement; NaN if nothing moves."""
        still = standstill(reference.scene, reference.positions)
        return self.differences(reference) / (np.nan if still else mean_motion(reference.positions))

    def differences(self, reference: "Run") -> np.ndarray:
        """Compute norms (F',) m of the position differences from ``reference`` in each frame."""
        other = reference.positions[1 : len(self.positions)]
        return np.linalg.norm(self.positions[1:] - other, axis=(1, 2))

    def require_comparable(self, reference: Any) -> None:
        """Raise ConfigurationError unless ``reference`` is a run comparable with this run."""
        if not isinstance(reference, Run):
            raise ConfigurationError(f"reference = {shown(reference, 60)}: a Run is required")
        own, other = self.scene, reference.scene
        for name, same in (
            ("mesh", np.array_equal(own.mesh.points, other.mesh.points)),
            ("time step", own.config.time_step == other.config.time_step),
            ("number of frames", own.config.frames == other.config.frames),
        ):
            if not same:
                fault = f"compared runs need the same {name}, unlike {reference.title}"
                raise ConfigurationError(f"{self.title}: {fault}")


def standstill(scene: Scene, positions: np.ndarray) -> str:
    """Return a message if ``positions`` (F + 1, N, 3) m of a run of ``scene`` hardly change, or "".

    Vertices that are held in every frame do not count, as their positions are prescribed.
    """
    held = (held_vertices(scene.boundaries, frame) for frame in range(len(positions) - 1))
    every = np.arange(scene.mesh.vertices)
    free = np.setdiff1d(every, reduce(np.intersect1d, held, every))
    moved = float(np.ptp(positions, axis=0)[free].max(initial=0.0))
    if moved > STILL * scene.mesh.extent:
        return ""
    size = f"{len(free)} free vertices move by at most {moved:.2g} m, below {STILL:g} of the extent"
    return f"nothing moves: {size}; there is nothing to reduce"


_SNAPSHOTS = ("p", "roundoff", "frames")


def stored_run(scene: Scene, file: h5py.File) -> Run:
    """Read the run of ``scene`` from the open HDF5 ``file``."""
    stored, ended = file.get("snapshots", {}), int(file.attrs.get("blowup_frame", -1))
    return Run(
        scene, file["positions"][...], file["timings"][...].sum(axis=1),
        {name: Snapshots(*(s[key][...] for key in _SNAPSHOTS)) for name, s in stored.items()},
        str(file.attrs.get("method", FULL)), None if ended < 0 else ended,
        file["frame_error"][...] if "frame_error" in file else None,
    )  # fmt: skip


def store_run(run: Run, file: h5py.File) -> None:
    """Write ``run``, with its mesh, to the open HDF5 ``file``."""
    store_mesh(run.scene.mesh, file.create_group("mesh"))
    file["positions"], file["timings"] = run.positions, run.ms[:, None]
    for name, unit in (("positions", "m"), ("timings", "ms")):
        file[name].attrs["unit"] = unit
    for name, own in run.snapshots.items():
        kept = file.create_group(f"snapshots/{name}")
        for key in _SNAPSHOTS:
            kept[key] = getattr(own, key)
        group = run.scene.group(name)
        kept.attrs.update(elements=group.elements, rows_per_element=group.rows_per_element)
    if run.frame_error is not None:
        file["frame_error"] = run.frame_error
    file.attrs["method"] = run.method
    file.attrs["blowup_frame"] = -1 if run.blowup_frame is None else run.blowup_frame
