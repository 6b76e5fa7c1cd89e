"""One scene over the time step and over the stiffness, by every method."""

import logging
from collections.abc import Iterator
from typing import Annotated, Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.sampling.local_step import rerun, rerun_reduced
from pdrom.reduction.subspace.model import SubspaceModel, load_models, rerun_model
from study.artifact.paths import BASIS, MESH, SAMPLING, STABILITY, SUBSPACES, File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit
from study.experiments.kit.base import experiment

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "method", "r", "h", "stiffness_ratio", "finite", "blowup_frame", "max_extent",
    "energy_ratio", "gain", "group", "position_basis", "k", "frames", "relative_error",
]  # fmt: skip
Local = list[tuple[dict[str, Any], Reduction | None]]  # labels, and the reduction
Models = list[tuple[dict[str, Any], SubspaceModel]]


class ShortRuns(ConfigModel):
    """Short runs over the time step and over the stiffness of the reduced groups.

    The bases and samplings are those of the scene's own setting.

    ranks : basis sizes, as far as the study holds them; position subspaces run at their largest
    time_steps : h in seconds, in addition to the scene's own
    stiffness_ratios : factors on the weights of the reduced groups, in addition to 1
    duration : seconds of simulated time, within ``min_frames`` and ``max_frames``
    """

    ranks: tuple[kit.Rank, ...] = ()
    time_steps: tuple[Annotated[float, Field(gt=0.0, le=10.0)], ...] = ()
    stiffness_ratios: tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...] = ()
    duration: Annotated[float, Field(gt=0.0)] = 1.0
    min_frames: Annotated[int, Field(ge=2)] = 30
    max_frames: Annotated[int, Field(ge=2)] = 120

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.max_frames < self.min_frames:
            raise ValueError(
                f"max_frames = {self.max_frames}: at least min_frames = {self.min_frames}"
            )
        return self


class Stability(ShortRuns):
    """Section ``stability``: the short runs, and how they are judged.

    scenes : where, as far as the study holds them
    wrong : relative error above which a run is finite but wrong
    departure : multiple of the full-order run's largest extent above which a run has left the
        scene; the key is ``left``
    """

    scenes: tuple[str, ...] = ()
    wrong: Annotated[float, Field(gt=0.0)] = 0.1
    departure: Annotated[float, Field(gt=1.0, alias="left")] = 2.0

    @property
    def left(self) -> float:
        """`departure`, by its key."""
        return self.departure


@experiment(
    "Time step and stiffness of {scene}",
    reads={
        "mesh": MESH,
        "bases": Every(BASIS),
        "samplings": Every(SAMPLING),
        "subspaces": Every(SUBSPACES),
        "config": Setting("scene"),
        "methods": Setting("methods"),
        "short": Setting("stability"),
        "blowup_extent": Setting("blowup_extent"),
        "solver": Setting("solver"),
    },
    writes={"out": STABILITY},
)
def stability(
    mesh: File,
    bases: list[File],
    samplings: list[File],
    subspaces: list[File],
    config: SceneConfig,
    methods: dict[str, MethodSpec],
    short: ShortRuns,
    blowup_extent: kit.BlowupExtent,
    solver: kit.Solver,
    out: File,
) -> None:
    """Run the full order, every local reduction and the largest subspaces at every setting.

    Bases and samplings are those of the scene's own setting: how far do they carry?
    """
    scene = kit.scene_of(config, mesh)
    local: Local = []
    for file in samplings:
        spec = methods[file["method"]]
        basis = load_basis(kit.basis_of(file, spec, bases).path)
        for r in kit.resolve_ranks(short.ranks, basis.rank):
            labels = {"group": file["group"], "method": file["method"], "r": r}
            known = r <= basis.rank
            reduction = kit.load_reduction(basis, file.path, spec, r=r) if known else None
            local.append((labels | {"position_basis": "full"}, reduction))
    models: Models = []
    for file in subspaces:
        found: Models = load_models(file.path)
        largest = max(labels["k"] for labels, _ in found)
        models += [(labels, model) for labels, model in found if labels["k"] == largest]
    # one of time step and stiffness at a time leaves the scene's own setting
    h, limits = scene.config.time_step, (short.min_frames, short.max_frames)
    ratios = sorted({1.0, *short.stiffness_ratios} - {1.0})
    grid = [(step, 1.0) for step in sorted({h, *short.time_steps})] + [(h, own) for own in ratios]
    rows = []
    for step, ratio in grid:
        other = kit.varied(scene.config, step, ratio, duration=short.duration, frames=limits)
        case = Scene.build(other, scene.mesh)
        own = {"scene": config.name, "h": step, "stiffness_ratio": ratio}
        rows += [own | row for row in _rows(case, local, models, solver, blowup_extent)]
        log.info("h = %g s, stiffness times %g: %d frames", step, ratio, other.frames)
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = ["r", "blowup_frame", "k", "frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), out.path)


def _rows(
    scene: Scene, local: Local, models: Models, solver: str, limit: float
) -> Iterator[dict[str, Any]]:
    """Rows of the full order of ``scene`` and, if that is finite, of everything else.

    ``limit`` is the extent of a blow-up over that of the rest shape; a reduction is None where the
    basis has fewer modes.
    """
    system = scene.system_with(solver)
    nothing = np.zeros((scene.config.frames + 1, *scene.mesh.points.shape))
    full = rerun(scene, system, scene.groups, reference=nothing, blowup_extent=limit)
    own = Yardstick(scene, full.positions)

    def row(labels: dict[str, Any], outcome: Rerun) -> dict[str, Any]:
        energy = {"energy_ratio": own.scale.ratio(outcome.positions)}
        return {**labels, **outcome.row(own.displacement), **energy}

    whole = row({"method": "full", "position_basis": "full"}, full)
    if not full.finite:
        log.warning("the full-order run blew up: nothing to compare with")
        yield whole
        return
    yield {**whole, "relative_error": 0.0}
    for labels, reduction in local:
        if reduction is None:
            yield {**labels, "frames": 0}
            continue
        outcome = rerun_reduced(scene, labels["group"], reduction, own.reference, limit, system)
        yield row({**labels, "gain": reduction.gain}, outcome)
    for labels, model in models:
        outcome = rerun_model(scene, model, own.reference, blowup_extent=limit)
        yield row({"group": "all", **labels}, outcome)
