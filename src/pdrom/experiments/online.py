"""One large scene in position subspaces, against its own full-order run in the same job.

Everything is made here and nothing is kept but the rows of the table: full-order runs of both
motions, columns from training frames, element sampling, reduced runs, and times. Full-order and
reduced steps are timed in turn by the protocol of `pdrom.experiments.measurement`.
"""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pdrom.core.paths import ONLINE, File
from pdrom.core.reads import SourcesOf
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.declaration import Experiment, JobSettings
from pdrom.experiments.measurement import Protocol, Variant, measure
from pdrom.experiments.motion import training_indices
from pdrom.experiments.settings import Modes, PositionBasis, Tolerance
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements
from pdrom.reduction.subspace.rerun import rerun_model
from pdrom.reduction.subspace.training import Norm

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "vertices", "elements", "position_basis", "k", "tau", "elements_sampled",
    "relative_error_train", "relative_error_heldout", "ms_per_frame", "ms_per_iteration",
    "fom_ms_per_frame", "speedup",
]  # fmt: skip


class OnlineModels(ConfigModel):
    """Models of a large scene: bases, numbers of modes, tolerances and norm of the sampling."""

    bases: tuple[PositionBasis, ...] = ("pod",)
    sizes: tuple[Modes, ...] = (20,)
    tolerances: tuple[Tolerance, ...] = (1e-2,)
    norm: Norm = "energy"


class Online(OnlineModels):
    """Section ``online``: the models, and the large ``scenes`` that are reduced by them."""

    scenes: tuple[str, ...] = ()


class Settings(JobSettings):
    """What the rows of a large scene depend on, beside the machine."""

    scene: SceneConfig
    online: OnlineModels
    timing: Protocol


@dataclass(frozen=True)
class Inputs:
    """Files read: that of the mesh, nothing for a generated one."""

    sources: Annotated[list[str], SourcesOf("scene.mesh")]


@dataclass(frozen=True)
class Outputs:
    """Files written: a row for every basis, size and tolerance."""

    table: Annotated[File, ONLINE]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Reduce a scene by every model and time each beside the full order."""
    config, asked, timing = settings.scene, settings.online, settings.timing
    mesh = config.mesh.build(Path())
    train = Scene.build(config, mesh)
    heldout = Scene.build(config.heldout_variant(), mesh)
    references = [trajectory(motion, track_objective=False) for motion in (train, heldout)]
    log.info("%s: full-order runs of %d vertices", config.name, mesh.vertices)
    frames = training_indices(train)
    rows, variants = [], []
    for kind in asked.bases:
        for k in asked.sizes:
            columns = make_columns(train, references[0][1:][frames], kind, k)
            found = sample_elements(train, columns, frames, asked.tolerances, norm=asked.norm)
            for tolerance, samples in zip(asked.tolerances, found, strict=True):
                model = SubspaceModel(kind, columns, samples)
                errors = [
                    relative_error(motion, model, reference)
                    for motion, reference in zip((train, heldout), references, strict=True)
                ]
                rows.append(_row(train, model, k, tolerance, errors))
                variants.append(_variant(*model.loop(train), timing, config))
                log.info("%s k=%d tau=%g", kind, k, tolerance)
    stepper = train.stepper(track_objective=False)
    variants.append(_variant(stepper, train.initial_state(), timing, config))
    *reduced, full = measure(variants, timing.warmup, timing.repeats)
    for row, measurement in zip(rows, reduced, strict=True):
        row["ms_per_frame"] = measurement.frame
        row["ms_per_iteration"] = measurement.frame / config.iterations
        row["fom_ms_per_frame"] = full.frame
        row["speedup"] = full.frame / measurement.frame
    write_table(pd.DataFrame(rows, columns=COLUMNS), outputs.table.path)


def _row(
    scene: Scene,
    model: SubspaceModel,
    k: int,
    tolerance: float,
    errors: list[float | None],
) -> dict[str, Any]:
    return {
        "scene": scene.config.name,
        "vertices": scene.mesh.vertices,
        "elements": sum(group.elements for group in scene.groups),
        "position_basis": model.position_basis,
        "k": k,
        "tau": tolerance,
        "elements_sampled": model.elements_evaluated(scene),
        "relative_error_train": errors[0],
        "relative_error_heldout": errors[1],
    }


def relative_error(scene: Scene, model: SubspaceModel, reference: np.ndarray) -> float | None:
    """Relative error of a run against ``reference`` (F + 1, N, 3); None if it blows up."""
    error = rerun_model(scene, model, reference).error(displacement_norms(reference))
    return error if error is not None and np.isfinite(error) else None


def _variant(loop: Stepper, state: State, timing: Protocol, config: SceneConfig) -> Variant:
    return Variant({}, loop, state, min(timing.frames, config.frames))


EXPERIMENT = Experiment("online", "Online cost of {scene}", run, alone=True)
