"""Run reductions in hard cases (scenes with extreme input); explain the expected failures."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import AfterValidator, Field

from pdrom.core.errors import NotReducibleError, PdromError, choices
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, shown
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.effects import EFFECTS
from pdrom.reduction.basis import group_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, rerun
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import recorded
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import reduced_state
from pdrom.reduction.subspace.training import make_columns, sampled_models
from study.artifact.paths import HARD_CASES, File
from study.artifact.reads import ProjectFile, Setting
from study.experiments.hard_cases.catalogue import FILES, LIST, HardCase, cases, start_of
from study.experiments.kit.base import experiment

HOLDS, NOTHING, NOT_TAKEN = "holds", "nothing to reduce", "not taken"
R, K, TOLERANCE = 10, 6, 1e-2
HRPD = HrpdSpec(dimension=20, samples=60)
BASES = {"pod": ("full", "ecsw", "hrpd"), "skinning": ("full", "hrpd")}
# Limits for the longest side of a run's bounding box, as multiples of `Training.extent`: above the
# first limit, the run blew up; above the second limit, it is distorted.
BLOWUP, DISTORTED = 100.0, 3.0
Model = SubspaceModel | ProjectionModel
# Kinds of constraint manifolds on which the norm of projections is bounded for all states.
BOUNDED = ("clamped", "length", "half sphere")
Methods = Mapping[str, MethodSpec]
log = logging.getLogger(__name__)
COLUMNS = [
    "case", "method", "bounded_projections", "k", "r", "gain", "frames", "finite", "blowup_frame",
    "max_extent", "outcome", "why",
]  # fmt: skip


def _known(case: str) -> str:
    if case not in cases():
        raise ValueError(f"unknown case {shown(case, 60)}{choices(case, cases())}")
    return case


Cases = tuple[Annotated[str, AfterValidator(_known)], ...]


class Expectation(ConfigModel):
    """Hard cases in which a reduction fails, and the reason (``why``).

    fails : names of hard cases in which the reduction must fail
    may_fail : names of hard cases in which rounding errors decide whether it fails
    """

    why: Annotated[str, Field(min_length=20)]
    fails: Cases = ()
    may_fail: Cases = ()


class Training:
    """Full-order run of a hard case, with snapshots of its first group, which is reduced.

    positions : (F + 1, N, 3) m, initial positions first
    snapshots : projections (n, e p, 3) of every second frame, and the norm of their rounding errors
    extent : longest side (m) of the bounding boxes of all frames and of the rest shape
    """

    def __init__(self, case: HardCase) -> None:
        self.scene = case.scene()
        self.group: ConstraintGroup = self.scene.groups[0]
        self.start = start_of(self.scene, **case.start)
        self.positions, p, roundoff = recorded(self.scene, self.group.name, self.start)
        self.snapshots = p[::2], float(np.linalg.norm(roundoff[::2]))
        self.extent = max(self.scene.mesh.extent, float(np.ptp(self.positions, axis=1).max()))


def names(methods: Methods) -> list[str]:
    """List all reductions: ``methods``, then those in position subspaces (such as pod-ecsw)."""
    return [*methods, *(f"{basis}-{sampling}" for basis in BASES for sampling in BASES[basis])]


def reduced_model(training: Training, name: str, methods: Methods) -> Model | None:
    """Train the reduction ``name``; None if the projections are rounding errors (no mode is left).

    In a name such as "pod-ecsw", "full" evaluates all projections, "ecsw" the projections of some
    elements, and "hrpd" interpolates all projections from some of them. Raises PdromError if the
    reduction refuses the scene.
    """
    scene, group = training.scene, training.group
    if name in methods:
        spec = methods[name]
        basis = group_basis(group, scene.masses, *training.snapshots, spec)
        r = min(R, basis.rank)
        if r == 0:
            return None
        return ProjectionModel(group.name, Reduction(basis, select(basis, spec, r), spec, r=r))
    kind, _, sampling = name.partition("-")
    modes: dict[str, Any] = {kind: K}
    columns = make_columns([scene], training.positions[1::2], **modes)
    if sampling == "ecsw":
        start = reduced_state(scene, columns, training.start)
        frames = np.arange(scene.config.frames)
        return sampled_models([scene], columns, frames, [TOLERANCE], start)[0]
    fitted, points = scene.groups if sampling == "hrpd" else (), scene.mesh.points
    found = {g.name: hrpd(g, columns, sampled_space(g, points, HRPD)) for g in fitted}
    return SubspaceModel(columns, found)


def reduced_run(training: Training, model: Model) -> Rerun:
    """Run the hard case with ``model``, at most until its extent exceeds `BLOWUP` x `extent`."""
    scene, start, (loop, _) = training.scene, training.start, model.loop(training.scene)
    if isinstance(model, SubspaceModel):
        start = reduced_state(scene, model.columns, start)
        loop = Stepper(loop.space, loop.time_step, loop.iterations, loop.local_steps, False)
    limit = BLOWUP * training.extent / scene.mesh.extent
    return rerun(scene, loop, start, None, limit, model.positions)


def row(
    training: Training, name: str, methods: Methods, expected: Mapping[str, Expectation]
) -> dict[str, Any]:
    """Return the table row of the reduction ``name``: outcome of its run, reason of a failure."""
    try:
        model = reduced_model(training, name, methods)
        if model is None:
            return {"r": 0, "frames": 0, "outcome": NOTHING, "why": "projections are round-off"}
        run = reduced_run(training, model)
    except NotReducibleError as error:
        return {"frames": 0, "outcome": NOT_TAKEN, "why": str(error)}
    except PdromError as error:
        return {"frames": 0, "finite": False, "outcome": "refused", "why": str(error)}
    if isinstance(model, ProjectionModel):
        sizes = {"r": model.reduction.r, "gain": model.reduction.gain}
    else:
        sizes = {"k": model.columns.B.shape[1], "r": model.elements_evaluated(training.scene)}
    extent = float(np.ptp(run.positions, axis=1).max()) / training.extent
    outcome = HOLDS
    if sizes.get("gain") == np.inf:
        outcome = "singular"
    elif not run.finite:
        outcome = "blow-up"
    elif extent > DISTORTED:
        outcome = "distorted"
    ended = {"frames": run.frames, "finite": run.finite, "blowup_frame": run.blowup_frame}
    why = expected[name].why if name in expected and outcome != HOLDS else ""
    return {**sizes, **ended, "max_extent": extent, "outcome": outcome, "why": why}


class HardCases(ConfigModel):
    """Section ``hard_cases`` of the configuration.

    cases : names of the hard cases to run; default: all
    expected : reduction -> its expected failures; a reduction without an entry must never fail
    """

    cases: Cases = ()
    expected: dict[str, Expectation] = Field(default_factory=dict)

    @property
    def modules(self) -> list[str]:
        """Classes ("module:attribute") of the effects in hard cases, for the job's fingerprint."""
        chosen = self.cases or cases()
        effects = {effect["effect"] for name in chosen for effect in cases()[name].effects}
        return sorted(EFFECTS[effect] for effect in effects)


@experiment(
    "Hard cases with every reduction",
    reads={
        "listed": ProjectFile(tuple(f"config/{name}" for name in (LIST, *FILES))),
        "every_method": Setting("every_method"),
        "asked": Setting("hard_cases"),
    },
    writes={"out": HARD_CASES},
)
def hard_cases(
    listed: list[Path], every_method: dict[str, MethodSpec], asked: HardCases, out: File
) -> None:
    """Run hard cases with every reduction, and write their outcomes.

    ``listed`` only declares inputs of the job: the hard cases read these files themselves.
    """
    found = []
    for name in asked.cases or cases():
        training = Training(cases()[name])
        bounded = training.group.manifold in BOUNDED
        for method in names(every_method):
            own = row(training, method, every_method, asked.expected)
            found.append({"case": name, "method": method, "bounded_projections": bounded, **own})
        log.info("%s: done", name)
    whole = dict.fromkeys(["k", "r", "frames", "blowup_frame"], "Int64")
    write_table(pd.DataFrame(found, columns=COLUMNS).astype(whole), out.path)
