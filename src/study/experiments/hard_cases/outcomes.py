"""Outcomes of reductions in hard cases (scenes with extreme input), and the expected outcomes."""

import logging
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import pandas as pd
from pydantic import AfterValidator, Field, model_validator

from pdrom.core.errors import NotReducibleError, PdromError, choices
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, shown
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.effects import EFFECTS
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.snapshots import row_masses
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel, make_columns, sample_elements
from pdrom.reduction.subspace.space import coordinates
from study.artifact.paths import HARD_CASES, File
from study.artifact.reads import ProjectFiles, Setting
from study.experiments.hard_cases import record
from study.experiments.hard_cases.catalogue import CASES, MESHES, reducible_cases
from study.experiments.kit.base import experiment

HOLDS, NOTHING, NOT_TAKEN = "holds", "nothing to reduce", "not taken"
FAILURES = ("refused", "singular", "blow-up", "distorted", "objective rises", "momentum changes")
R, K, TOLERANCE = 10, 6, 1e-2
HRPD = HrpdSpec(dimension=20, samples=60)
BASES = {"pod": ("full", "ecsw", "hrpd"), "skinning": ("full", "hrpd")}
# Longest sides of a run's bounding box, as multiples of `Training.extent`: above the first, the run
# blew up; above the second, it is distorted.
BLOWUP, DISTORTED = 100.0, 3.0
# Kinds of constraint manifolds on which the norm of projections is bounded, whatever the state.
BOUNDED = ("clamped", "length", "half sphere")
Methods = Mapping[str, MethodSpec]
log = logging.getLogger(__name__)
COLUMNS = [
    "case", "method", "bounded_projections", "k", "r", "gain", "frames", "finite", "blowup_frame",
    "max_extent", "outcome", "why",
]  # fmt: skip


def _known(case: str, cases: Collection[str]) -> str:
    if case not in cases:
        raise ValueError(f"unknown case {shown(case, 60)}{choices(case, cases)}")
    return case


Cases = tuple[Annotated[str, AfterValidator(lambda case: _known(case, CASES))], ...]
ReducibleCase = Annotated[str, AfterValidator(lambda case: _known(case, reducible_cases()))]


class Expectation(ConfigModel):
    """Hard cases in which a reduction fails, and the reason (``why``).

    fails : names of hard cases in which the reduction must fail
    may_fail : names of hard cases in which it fails or not, depending on rounding errors
    """

    why: Annotated[str, Field(min_length=20)]
    fails: Cases = ()
    may_fail: Cases = ()

    @model_validator(mode="after")
    def _listed_once(self) -> Self:
        for case, times in Counter((*self.fails, *self.may_fail)).items():
            if times > 1:
                raise ValueError(f"case '{case}' is listed twice")
        return self


def surprise(outcome: str, case: str, expected: Expectation | None) -> str:
    """Text on how the ``outcome`` in a hard case contradicts the expected one; empty if not."""
    must, may = (expected.fails, expected.may_fail) if expected else ((), ())
    if outcome in FAILURES:
        listed = case in (*must, *may)
        return "" if listed else f"{outcome}, but no entry expects a failure"
    return f"{outcome}, but the entry expects a failure" if case in must else ""


class Training:
    """Full-order run of a hard case, with snapshots of its first group, which is reduced."""

    def __init__(self, case: record.HardCase) -> None:
        self.case = case
        self.scene = case.scene()
        self.group: ConstraintGroup = self.scene.groups[0]
        self._snapshots: list[np.ndarray] = []
        self._roundoff: list[float] = []
        loop = self.scene.stepper()
        self._own: ConstraintGroup = loop.local_step(self.group.name)
        self.run = record.record(self.scene, loop, case.start(self.scene), observe=self._observe)
        self._bases: dict[str, Basis] = {}
        # longest side (m) of the bounding boxes of all frames, rest shape and fixed vertices
        self.extent = max(self.run.extent, record.reach(self.scene, self.run))

    def _observe(self, frame: int, y: np.ndarray) -> None:
        if frame % 2 == 0 or self.scene.config.frames == 1:
            self._snapshots.append(self._own.project(y))
            self._roundoff.append(self.group.roundoff(y))

    def basis(self, spec: MethodSpec) -> Basis:
        """Return the basis of the snapshots, with the centring, weights etc. of ``spec``."""
        if spec.basis_id not in self._bases:
            self._bases[spec.basis_id] = compute_basis(
                np.stack(self._snapshots),
                row_masses(self.group, self.scene.masses),
                float(np.linalg.norm(self._roundoff)),
                rows_per_element=self.group.rows_per_element,
                spec=spec,
            )
        return self._bases[spec.basis_id]


@dataclass(frozen=True)
class ReducedRun:
    """A reduced run, and sizes of the reduction.

    run : None if the basis is empty, so that nothing can be reduced
    r : basis size; in a position subspace the number of evaluated elements
    k : number of columns of the position subspace, None if positions are not reduced
    gain : factor by which the interpolation amplifies errors, None without interpolation
    """

    run: record.Record | None
    r: int
    k: int | None = None
    gain: float | None = None

    def outcome(self, training: Training) -> str:
        """Return the first failure, `HOLDS` if there is none, `NOTHING` if there is no run."""
        run = self.run
        if run is None:
            return NOTHING
        if self.gain == np.inf:
            return "singular"
        if run.blowup_frame is not None:
            return "blow-up"
        if run.extent > DISTORTED * training.extent:
            return "distorted"
        # In a position subspace, the objective must fall in every iteration, as in full order. With
        # unreduced positions and interpolated projections it may rise.
        if self.k is not None and run.excess.max() > 0.0:
            return "objective rises"
        # internal forces S^T W p sum to zero for any projections p: reduction keeps the momentum
        case = training.case
        if "momentum" in case.holds and record.momentum(case, training.scene, run):
            return "momentum changes"
        return HOLDS


def names(methods: Methods) -> list[str]:
    """Names of all reductions: ``methods``, then those in position subspaces (such as pod-ecsw)."""
    return [*methods, *(f"{basis}-{sampling}" for basis in BASES for sampling in BASES[basis])]


def reduced_run(training: Training, name: str, methods: Methods, limit: float) -> ReducedRun:
    """Run the hard case of ``training`` again, with the reduction ``name``.

    The run ends as a blow-up if a side of its bounding box exceeds ``limit`` (m). Raises PdromError
    if the reduction refuses the scene.
    """
    if name not in methods:
        kind, _, sampling = name.partition("-")
        return _subspace(training, kind, sampling, limit)
    scene, group, spec = training.scene, training.group, methods[name]
    basis = training.basis(spec)
    r = min(R, basis.rank)
    if r == 0:
        return ReducedRun(None, 0)
    reduction = Reduction(basis, select(basis, spec, r), spec, r=r)
    step = record.Watched(ReducedLocalStep(group, reduction), group)
    loop = scene.stepper(local_steps=replace_group(scene, group.name, step))
    run = record.record(scene, loop, training.case.start(scene), limit=limit)
    return ReducedRun(run, r, gain=reduction.gain)


def _subspace(training: Training, kind: str, sampling: str, limit: float) -> ReducedRun:
    """Run in a subspace of positions, "pod" or "skinning" (``kind``); ``limit``: see `reduced_run`.

    ``sampling``: "full" evaluates all projections, "ecsw" only those of some elements, "hrpd" fits
    all to those of some. ECSW is trained on a "full" run from the initial state of the hard case.
    """
    scene = training.scene
    columns = make_columns(scene, training.run.positions[1::2], kind, k=K)
    start = training.case.start(scene)
    q, v = (coordinates(columns, scene.masses, f) for f in (start.positions, start.velocities))
    state = State(q, v)
    samples: Mapping[str, Samples | Interpolation] = {}
    if sampling == "ecsw":
        frames = np.arange(scene.config.frames)
        (samples,) = sample_elements(scene, columns, frames, tolerances=[TOLERANCE], start=state)
    elif sampling == "hrpd":
        points = scene.mesh.points
        samples = {g.name: hrpd(g, columns, sampled_space(g, points, HRPD)) for g in scene.groups}
    model = SubspaceModel(kind, columns, samples)
    untracked, _ = model.loop(scene)
    h, iterations = untracked.time_step, untracked.iterations
    loop = Stepper(untracked.space, h, iterations, local_steps=untracked.local_steps)
    run = record.record(scene, loop, state, model, limit)
    return ReducedRun(run, model.elements_evaluated(scene), k=columns.B.shape[1])


def row(
    training: Training, name: str, methods: Methods, expected: Mapping[str, Expectation]
) -> dict[str, Any]:
    """Row of the run with the reduction ``name``: how it ended, and why if it failed."""
    try:
        reduced = reduced_run(training, name, methods, limit=BLOWUP * training.extent)
    except NotReducibleError as error:
        return {"frames": 0, "outcome": NOT_TAKEN, "why": str(error)}
    except PdromError as error:
        return {"frames": 0, "finite": False, "outcome": "refused", "why": str(error)}
    run, outcome, entry = reduced.run, reduced.outcome(training), expected.get(name)
    found = {"k": reduced.k, "r": reduced.r, "gain": reduced.gain, "outcome": outcome}
    if run is None:
        return {**found, "frames": 0, "why": "projections are round-off"}
    return {
        **found,
        "frames": len(run.rise),
        "finite": run.blowup_frame is None,
        "blowup_frame": run.blowup_frame,
        "max_extent": run.extent / training.extent,
        "why": entry.why if entry and outcome in FAILURES else "",
    }


class HardCases(ConfigModel):
    """Section ``hard_cases`` of the configuration.

    cases : names of the hard cases that are run; without names, all that are not slow
    expected : reduction -> its expected failures; a reduction without an entry must never fail
    """

    cases: tuple[ReducibleCase, ...] = ()
    expected: dict[str, Expectation] = Field(default_factory=dict)

    @property
    def modules(self) -> list[str]:
        """Classes ("module:attribute") of the hard cases' effects, for the job's fingerprint."""
        chosen = self.cases or reducible_cases()
        effects = {effect["effect"] for name in chosen for effect in CASES[name].effects}
        return sorted(EFFECTS[effect] for effect in effects)


@experiment(
    "Hard cases of every reduction",
    reads={
        "meshes": ProjectFiles(tuple(f"config/scenes/meshes/{name}" for name in MESHES)),
        "every_method": Setting("every_method"),
        "asked": Setting("hard_cases"),
    },
    writes={"cases": HARD_CASES},
)
def hard_cases(
    meshes: list[Path], every_method: dict[str, MethodSpec], asked: HardCases, cases: File
) -> None:
    """Run hard cases with every reduction; log outcomes that contradict the expected ones.

    ``meshes`` only declares inputs of the job: the hard cases read these files themselves.
    """
    found = []
    for name in asked.cases or reducible_cases():
        training = Training(CASES[name])
        bounded = training.group.manifold in BOUNDED
        for method in names(every_method):
            own = row(training, method, every_method, asked.expected)
            found.append({"case": name, "method": method, "bounded_projections": bounded, **own})
            contradiction = surprise(own["outcome"], name, asked.expected.get(method))
            if contradiction:
                log.warning("%s, %s: %s", name, method, contradiction)
        log.info("%s: done", name)
    whole = dict.fromkeys(["k", "r", "frames", "blowup_frame"], "Int64")
    write_table(pd.DataFrame(found, columns=COLUMNS).astype(whole), cases.path)
