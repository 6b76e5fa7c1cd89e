"""Model of a scene in a position subspace: columns, sampled elements, step loop, and storage."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import h5py
import numpy as np

from pdrom.core.errors import NotReducibleError
from pdrom.core.store import open_hdf5
from pdrom.model.compiled.functions import compiled
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.settings import Setting
from pdrom.reduction.subspace import columns as spaces
from pdrom.reduction.subspace import interpolation
from pdrom.reduction.subspace.ecsw import Samples
from pdrom.reduction.subspace.fused import FusedStepper
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.space import ReducedSpace, reduced_state

ECSW = "ecsw"
ALL = 256  # Newton iterations of a frame that suffice for convergence


def ecsw_name(tolerance: float) -> str:
    """Return the name in tables of a model with energy-conserving sampling at ``tolerance``."""
    return f"{ECSW}-{tolerance:.0e}"


@dataclass(frozen=True)
class SubspaceModel:
    """Reduced model: columns of a position subspace, and samples of constraint groups.

    A group without samples evaluates all elements with factor one.
    """

    columns: spaces.Columns
    samples: Mapping[str, Samples | Interpolation] = field(default_factory=dict)

    def elements_evaluated(self, scene: Scene) -> int:
        """Count the elements of ``scene`` whose projections an iteration evaluates."""
        return sum(len(self.chosen(group).elements) for group in scene.groups)

    @property
    def title(self) -> str:
        """Number of modes."""
        return f"{self.columns.modes} modes"

    @property
    def residual(self) -> float | None:
        """Largest relative residual of the training equations of a group; None without samples."""
        found = [own.residual for own in self.samples.values() if isinstance(own, Samples)]
        return max(found, default=None)

    def chosen(self, group: ConstraintGroup) -> Samples | Interpolation:
        """Return samples or interpolation of ``group``; else all elements with factor 1."""
        every = Samples(np.arange(group.elements), np.ones(group.elements))
        return self.samples.get(group.name, every)

    def loop(self, scene: Scene, newton: bool = False) -> tuple[Stepper, State]:
        """Return the step loop of ``scene``, local-global or ``newton``, and the initial state."""
        steps: list[Any] = []
        for group in scene.groups:
            own = self.chosen(group)
            if isinstance(own, Interpolation):
                steps.append(interpolation.InterpolatedLocalStep(group, self.columns, own))
            else:
                kept = own.elements, own.factors
                steps.append(interpolation.SubspaceLocalStep(group, self.columns, *kept))
        space = ReducedSpace(scene, self.columns, [step.matrix for step in steps])
        return FusedStepper(scene, space, steps, newton), reduced_state(scene, self.columns)

    def positions(self, z: np.ndarray) -> np.ndarray:
        """Return vertex positions (N, 3) m of coordinates ``z`` (K, 3)."""
        return self.columns.B @ z

    def output(self, kind: Any = np.float32) -> "Output":
        """Return a faster form of `positions` in the precision ``kind``, for one thread."""
        return Output(self.columns.B, kind)


def reduced(
    labels: dict[str, Any], scene: Scene, model: SubspaceModel, count: int | None, newton: bool
) -> Setting:
    """Return a setting with ``model`` and ``count`` iterations per frame (None: until convergence),
    local-global or ``newton``."""
    loop, start = model.loop(scene.iterated(count or ALL), newton)
    state = partial(reduced_state, scene, model.columns)
    return Setting(labels, loop, start, model.positions, model.output(), state)


Labelled = tuple[dict[str, Any], SubspaceModel]
PANEL, TERMS = 512, 4


class Output:
    """Function of coordinates z (K, 3) that returns positions B z (N, 3) m in a ``kind`` of floats.

    ``B`` (N, K) is stored in panels of `PANEL` rows, and `TERMS` of its columns are added at a
    time, so that memory is read in order. Each call overwrites the last result.
    """

    def __init__(self, B: np.ndarray, kind: Any = np.float32) -> None:
        n, k = B.shape
        padded = np.zeros((-(-n // PANEL) * PANEL, -(-k // TERMS) * TERMS), kind)
        padded[:n, :k] = B
        panels = padded.reshape(-1, PANEL, padded.shape[1]).transpose(0, 2, 1)
        self._panels = np.ascontiguousarray(panels)
        self._z = np.zeros((padded.shape[1], 3), kind)
        self._sums, self._result = np.empty((3, PANEL), kind), np.empty((n, 3), kind)

    def __call__(self, z: np.ndarray) -> np.ndarray:
        self._z[: len(z)] = z
        _multiply(self._panels, self._z, self._sums, self._result)
        return self._result


@compiled(nogil=True)
def _multiply(panels, z, sums, result):
    """Write B z to ``result`` (N, 3). B is stored in ``panels``, and ``sums`` is a work array."""
    a, b, c = sums[0], sums[1], sums[2]
    for p in range(len(panels)):
        panel, first = panels[p], p * PANEL
        a[:], b[:], c[:] = 0.0, 0.0, 0.0
        for k in range(0, len(z), TERMS):
            # local variables, since the compiler would otherwise read z again for every vertex
            r, s, t, u = z[k], z[k + 1], z[k + 2], z[k + 3]
            r0, s0, t0, u0 = r[0], s[0], t[0], u[0]
            r1, s1, t1, u1 = r[1], s[1], t[1], u[1]
            r2, s2, t2, u2 = r[2], s[2], t[2], u[2]
            for i in range(len(a)):
                w, x, y, v = panel[k, i], panel[k + 1, i], panel[k + 2, i], panel[k + 3, i]
                a[i] += w * r0 + x * s0 + y * t0 + v * u0
                b[i] += w * r1 + x * s1 + y * t1 + v * u1
                c[i] += w * r2 + x * s2 + y * t2 + v * u2
        for i in range(min(PANEL, len(result) - first)):
            result[first + i, 0], result[first + i, 1], result[first + i, 2] = a[i], b[i], c[i]


def require_holds(scene: Scene, columns: spaces.Columns) -> None:
    """Raise NotReducibleError if ``scene`` fixes vertices for which there are no ``columns``."""
    for boundary in scene.boundaries:
        for unit in boundary.units():
            inside = [atom for atom in columns.atoms if np.isin(atom, unit).any()]
            found = np.sort(np.concatenate([np.empty(0, np.int64), *inside]))
            if not np.array_equal(found, np.sort(unit)):
                some = ", ".join(map(str, unit[:5])) + ", ..." * (len(unit) > 5)
                held = boundary.side or f"the vertices [{some}]"
                raise NotReducibleError(
                    f"scene '{scene.config.name}', effect '{boundary.name}': holds {held}, but "
                    "no training scene did; train again with hold=[...] (--hold)"
                )


def store_columns(store: h5py.Group, columns: spaces.Columns) -> None:
    """Write the ``columns`` of a subspace into the HDF5 group ``store``."""
    store["B"], store["free"] = columns.B, columns.free
    store.attrs["modes"] = columns.modes
    for i, (atom, own) in enumerate(zip(columns.atoms, columns.atom_columns, strict=True)):
        store[f"atoms/{i:04d}/vertices"], store[f"atoms/{i:04d}/columns"] = atom, own


def store_model(
    store: h5py.Group, labels: dict[str, Any], samples: Mapping[str, Samples | Interpolation]
) -> None:
    """Write ``samples`` of each constraint group and, as attributes, ``labels`` to ``store``."""
    store.attrs.update(labels)
    for name, chosen in samples.items():
        kept = store.create_group(f"samples/{name}")
        for key, value in vars(chosen).items():
            (kept if isinstance(value, np.ndarray) else kept.attrs)[key] = value


def stored_samples(store: h5py.Group) -> dict[str, Samples | Interpolation]:
    """Read samples of each constraint group from the HDF5 group ``store``."""
    found: dict[str, Samples | Interpolation] = {}
    for name, kept in store.get("samples", {}).items():
        numbers: dict[str, Any] = {key: float(value) for key, value in kept.attrs.items()}
        kind = Interpolation if "gain" in numbers else Samples
        found[name] = kind(**{key: array[...] for key, array in kept.items()}, **numbers)
    return found


def load_models(path: str | os.PathLike[str]) -> list[Labelled]:
    """Read pairs (labels, model) from the file ``path``; labels: method, position_basis and k."""
    with open_hdf5(path) as file:
        columns = {base: stored_columns(store) for base, store in file["columns"].items()}
        models = []
        for store in file["models"].values():
            base = str(store.attrs["base"])
            labels = {key: store.attrs[key] for key in ("method", "position_basis", "k")}
            labels["k"] = int(labels["k"])
            models.append((labels, SubspaceModel(columns[base], stored_samples(store))))
    return models


def stored_columns(store: h5py.Group) -> spaces.Columns:
    """Read columns from the HDF5 group ``store``, written by `store_columns`."""
    atoms = list(store["atoms"].values()) if "atoms" in store else []
    return spaces.Columns(
        B=store["B"][...],
        free=store["free"][...],
        atoms=[a["vertices"][...] for a in atoms],
        atom_columns=[a["columns"][...] for a in atoms],
        modes=int(store.attrs["modes"]),
    )
