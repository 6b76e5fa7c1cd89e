"""Classes of the runs that `pdrom.api.run` and `pdrom.api.reduce` return."""

from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any, get_type_hints

import h5py
import numpy as np
from pydantic import ConfigDict, Field, InstanceOf, create_model

from pdrom.core.errors import SnapshotError
from pdrom.core.packed import brief
from pdrom.core.store import require_finite
from pdrom.core.yamlfile import shown, validate
from pdrom.model.scene import Scene
from pdrom.reduction.deviations import Yardstick, errors_within
from pdrom.reduction.rerun import Rerun, mean_motion


def require_types(record: Any) -> None:
    """Raise ConfigurationError if a field of the dataclass ``record`` has not its declared type."""
    kind: Any = type(record)
    hints = get_type_hints(kind, include_extras=True)
    instance: Any = InstanceOf
    fields: Any = {n: (instance[h] if is_dataclass(h) else h, ...) for n, h in hints.items()}
    strict = ConfigDict(strict=True, arbitrary_types_allowed=True)
    validate(create_model(kind.__name__, __config__=strict, **fields), vars(record), kind.__name__)


def require_shapes(arrays: dict[str, tuple[np.ndarray, tuple[int, ...]]]) -> None:
    """Raise SnapshotError if one of the ``arrays`` is not of floats and of the shape beside it."""
    for name, (array, shape) in arrays.items():
        known = array.dtype in (np.float32, np.float64) and not np.ma.isMaskedArray(array)
        if array.shape != shape or not known:
            raise SnapshotError(f"{name} of {array.dtype} {array.shape}, required: float {shape}")


class Run:
    """Base of runs: fields have their declared types, arrays the shapes that the scene gives."""

    def __post_init__(self) -> None:
        require_types(self)
        require_shapes(arrays_of(self))
        if isinstance(self, ReducedRun):  # a full-order run that diverged is a result, too
            self.require_finite("run")

    def require_finite(self, name: str) -> None:
        """Raise SnapshotError, naming the run ``name``, if it has NaN or infinite numbers."""
        for array, (values, _) in arrays_of(self).items():
            if array not in ("difference", "extent"):
                require_finite(f"{name}: {array}", values, SnapshotError)


@dataclass(frozen=True, eq=False)
class Snapshots:
    """n training snapshots of a group: projections p (n, rows, 3), norms of round-off in p (n,)."""

    p: np.ndarray
    roundoff: np.ndarray

    __repr__ = brief

    def __post_init__(self) -> None:
        require_types(self)


@dataclass(frozen=True, eq=False)
class FullRun(Run):
    """A full-order run.

    positions : (F + 1, N, 3) m; entry 0 is the initial state
    ms : (F,) milliseconds of each frame
    snapshots : name of each constraint group -> its training snapshots
    """

    scene: Scene
    positions: np.ndarray
    ms: np.ndarray
    snapshots: dict[str, InstanceOf[Snapshots]]

    def __repr__(self) -> str:
        held = f"snapshots of {', '.join(self.snapshots)}" if self.snapshots else "no snapshots"
        return f"FullRun({self.scene!r}, {np.median(self.ms):.3g} ms a frame, {held})"


@dataclass(frozen=True, eq=False)
class ReducedRun(Run):
    """A run with the projections of one group reduced, compared with its full-order run.

    gain : factor by which sampling can amplify errors; 1 if every projection is evaluated
    outcome : positions (F' + 1, N, 3) m of F' frames, differences from the full order, any blow-up
    ms : median milliseconds per frame
    """

    full: FullRun
    group: str
    method: Annotated[str, Field(pattern=r"^\P{C}*$")]
    r: Annotated[int, Field(ge=1, le=1_000_000_000)]
    gain: InstanceOf[float]
    outcome: Rerun
    ms: InstanceOf[float]

    def __repr__(self) -> str:
        name, outcome = self.full.scene.config.name, self.outcome
        ended = f"error {self.error[-1]:.3g} at the end" if outcome.frames else "no frame"
        ended = ended if outcome.finite else f"blew up at frame {outcome.blowup_frame}"
        return f"ReducedRun('{name}': {self.title}, gain {self.gain:.3g}, {ended})"

    @property
    def error(self) -> np.ndarray:
        """Error of each frame (F',), relative to the RMS displacement of the full-order run."""
        return self.outcome.difference / mean_motion(self.full.positions)

    @property
    def errors(self) -> dict[str, float | None]:
        """Errors of the whole run: positions, velocities, shape, energy, first contact.

        Keys are column names of the table reduced_reruns. A value is None if the run ended early,
        or if the full-order run lacks the quantity, such as a first contact.
        """
        yardstick = Yardstick(self.full.scene, self.full.positions)
        end, seen = len(self.full.ms), yardstick.deviations(self.outcome)
        return errors_within(seen, yardstick.series, end, **yardstick.units)

    @property
    def title(self) -> str:
        """Text with the group, the method and the size r of the reduction."""
        return f"{self.group.replace('_', ' ')}, {self.method}, r = {self.r}"


AnyRun = FullRun | ReducedRun


def arrays_of(run: Any) -> dict[str, tuple[np.ndarray, tuple[int, ...]]]:
    """Arrays of a ``run`` of any kind by name, with the shapes that its scene gives them."""
    full = run.full if isinstance(run, ReducedRun) else run
    frames, vertices = full.scene.config.frames, full.scene.mesh.vertices
    arrays = {"positions": (full.positions, (frames + 1, vertices, 3)), "ms": (full.ms, (frames,))}
    for name, own in full.snapshots.items():
        group, count = full.scene.group(name), own.roundoff.size
        rows = group.elements * group.rows_per_element
        arrays[f"snapshots of {name}"] = own.p, (count, rows, 3)
        arrays[f"round-off of {name}"] = own.roundoff, (count,)
    if isinstance(run, ReducedRun):
        full.scene.group(run.group)
        require_types(run.outcome)
        if run.outcome.blowup_frame not in (None, *range(frames + 1)):
            raise SnapshotError(f"a blow-up in frame {shown(run.outcome.blowup_frame, 60)}")
        done, count = run.outcome, min(run.outcome.difference.size, frames)
        arrays["reduced"] = done.positions, (count + 1, vertices, 3)
        arrays["difference"] = done.difference, (count,)
        arrays["extent"] = done.extent, (count,)
    return arrays


def full_run(scene: Scene, file: h5py.File) -> FullRun:
    """Full-order run of ``scene`` from the open HDF5 ``file``."""
    stored = file.get("snapshots", {})
    return FullRun(
        scene,
        file["positions"][...],
        file["timings"][...].sum(axis=1),
        {name: Snapshots(s["p"][...], s["roundoff"][...]) for name, s in stored.items()},
    )
