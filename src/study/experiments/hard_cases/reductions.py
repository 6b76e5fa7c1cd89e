"""Every reduction, made from a hard case's own run: what it was trained on is what it repeats."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.snapshots import row_masses
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel, make_columns, sample_elements
from pdrom.reduction.subspace.space import coordinates
from study.experiments.hard_cases.case import HardCase
from study.experiments.hard_cases.record import Record, Watched, record
from study.experiments.hard_cases.roundoff import Roundoff
from study.experiments.hard_cases.runs import full_order

R, K, TOLERANCE = 10, 6, 1e-2

HRPD = HrpdSpec(dimension=20, samples=60)
BASES = {"pod": ("full", "ecsw", "hrpd"), "skinning": ("full", "hrpd")}


def _samples(
    sampling: str, scene: Scene, columns: Columns, start: State
) -> Mapping[str, Samples | Interpolation]:
    """Samples of each group in a position subspace; those of "ecsw" from a run from ``start``."""
    if sampling == "full":
        return {}
    if sampling == "ecsw":
        frames = np.arange(scene.config.frames)
        return sample_elements(scene, columns, frames, tolerances=[TOLERANCE], start=start)[0]
    points = scene.mesh.points
    return {g.name: hrpd(g, columns, sampled_space(g, points, HRPD)) for g in scene.groups}


class Training:
    """The full-order run of a case with the snapshots of its first group (the reduced one)."""

    def __init__(self, case: HardCase) -> None:
        self.case = case
        self.scene = case.scene()
        self.group: ConstraintGroup = self.scene.groups[0]
        self._snapshots: list[np.ndarray] = []
        self._roundoff: list[float] = []
        self.run = full_order(case, self.scene, self._observe)
        self._bases: dict[str, Basis] = {}

    def _observe(self, frame: int, y: np.ndarray) -> None:
        if frame % 2 == 0 or self.scene.config.frames == 1:
            self._snapshots.append(self.group.project(y))
            self._roundoff.append(self.group.roundoff(y))

    def basis(self, spec: MethodSpec) -> Basis:
        """Basis of the snapshots of the even frames, as ``spec`` asks."""
        if spec.basis_id not in self._bases:
            self._bases[spec.basis_id] = compute_basis(
                np.stack(self._snapshots),
                row_masses(self.group, self.scene.masses),
                float(np.linalg.norm(self._roundoff)),
                rows_per_element=self.group.rows_per_element,
                spec=spec,
            )
        return self._bases[spec.basis_id]

    def state(self) -> State:
        """The start of the case."""
        return self.case.start(self.scene)


@dataclass(frozen=True)
class ReducedRun:
    """Outcome of a reduced run; ``run`` is None where there is no basis.

    r : basis size, in a subspace the number of evaluated elements
    k : columns of the position subspace, None for vertices
    gain : of the interpolation, None where there is none
    """

    run: Record | None
    r: int
    k: int | None
    gain: float | None


def names(methods: Mapping[str, MethodSpec]) -> list[str]:
    """All reductions: the methods, then the position subspaces with what is sampled in them."""
    return [*methods, *(f"{basis}-{sampling}" for basis in BASES for sampling in BASES[basis])]


def reduced_run(
    training: Training, name: str, methods: Mapping[str, MethodSpec], limit: float
) -> ReducedRun:
    """Run the case of ``training`` again with the reduction ``name`` of ``methods``.

    ``limit`` is the extent of a blow-up, m.

    Raises
    ------
    PdromError
        Where the reduction itself refuses.
    """
    if name in methods:
        return _local(training, methods[name], limit)
    basis, _, sampling = name.partition("-")
    return _subspace(training, basis, sampling, limit)


def _local(training: Training, spec: MethodSpec, limit: float) -> ReducedRun:
    scene, basis = training.scene, training.basis(spec)
    r = min(R, basis.rank)
    if r == 0:
        return ReducedRun(None, 0, None, None)
    reduction = Reduction(basis, select(basis, spec, r), spec, r=r)
    step = Watched(ReducedLocalStep(training.group, reduction), training.group)
    loop = scene.stepper(local_steps=replace_group(scene, training.group.name, step))
    run = record(scene, loop, training.state(), roundoff=Roundoff(scene, loop), limit=limit)
    return ReducedRun(run, r, None, reduction.gain)


def _subspace(training: Training, kind: str, sampling: str, limit: float) -> ReducedRun:
    scene = training.scene
    columns = make_columns(scene, training.run.positions[1::2], kind, k=K)
    start = training.state()
    fields = (start.positions, start.velocities)
    state = State(*(coordinates(columns, scene.masses, field) for field in fields))
    model = SubspaceModel(kind, columns, _samples(sampling, scene, columns, state))
    untracked, _ = model.loop(scene)
    loop = Stepper(
        untracked.space,
        untracked.time_step,
        untracked.iterations,
        local_steps=untracked.local_steps,
    )
    roundoff = Roundoff(scene, loop, columns)
    run = record(scene, loop, state, roundoff=roundoff, positions=model.positions, limit=limit)
    return ReducedRun(run, model.elements_evaluated(scene), columns.B.shape[1], None)
