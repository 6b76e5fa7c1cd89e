"""One large scene in position subspaces, against its own full-order run in the same job.

Everything is made here: full-order runs of all motions, columns from training frames, element
sampling, reduced runs. Kept are the models, which `study.experiments.frame_times` times, and a row
for each.
"""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.model import (
    Samples,
    SubspaceModel,
    ecsw_name,
    make_columns,
    sample_elements,
)
from pdrom.reduction.subspace.rerun import rerun_model
from pdrom.reduction.subspace.store import store_columns, store_model
from pdrom.reduction.subspace.training import Norm
from study.artifact.paths import ONLINE, ONLINE_MODELS, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import clocked
from study.experiments.kit.motion import training_indices
from study.experiments.kit.settings import Modes, PositionBasis, Tolerance

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "vertices", "elements", "iterations", "position_basis", "k", "tau", "method",
    "elements_sampled", "relative_error_train", "relative_error_heldout",
    "relative_error_heldout_low", "relative_error_heldout_high", "reduction_s",
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


@experiment(
    "Reduction of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "asked": Setting("online"),
    },
    writes={"out": ONLINE, "models": ONLINE_MODELS},
)
def online(
    sources: list[Path], config: SceneConfig, asked: OnlineModels, out: File, models: File
) -> None:
    """Reduce a scene by every model and run the training and held-out motions with each.

    The error held out is the median over the motions, between the least and the largest; a run that
    blows up has an infinite one.
    """
    mesh = config.mesh.build(Path())
    train = Scene.build(config, mesh)
    motions = [train, *(Scene.build(config.heldout_variant(name), mesh) for name in MOTIONS)]
    references = [trajectory(motion, track_objective=False) for motion in motions]
    log.info("%s: full-order runs of %d vertices", config.name, mesh.vertices)
    rows = []
    with write_hdf5(models.path) as file:
        made = clocked(_models(train, references[0], asked))
        for seconds, (base, k, columns, found) in made:
            store_columns(file.create_group(f"columns/{base}"), columns)
            for tolerance, samples in zip(asked.tolerances, found, strict=True):
                model = SubspaceModel(base.partition("_")[0], columns, samples)
                row = _row(train, model, k, tolerance)
                labels = {key: row[key] for key in ("method", "position_basis", "k")}
                store = file.create_group(f"models/{base}_{row['method']}")
                store_model(store, {**labels, "base": base}, samples)
                own, *errors = (
                    relative_error(motion, model, reference)
                    for motion, reference in zip(motions, references, strict=True)
                )
                row |= {"relative_error_train": own, "reduction_s": seconds}
                rows.append(row | _over_motions(errors))
                log.info("%s k=%d tau=%g", base, k, tolerance)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _models(
    scene: Scene, reference: np.ndarray, asked: OnlineModels
) -> Iterator[tuple[str, int, Columns, list[dict[str, Samples]]]]:
    """Name, size and columns of every subspace, with the samples for each tolerance."""
    frames = training_indices(scene)
    for kind in asked.bases:
        for k in asked.sizes:
            columns = make_columns(scene, reference[1:][frames], kind, k=k)
            found = sample_elements(
                scene, columns, frames, tolerances=asked.tolerances, norm=asked.norm
            )
            yield f"{kind}_k{k:03d}", k, columns, found


def _row(scene: Scene, model: SubspaceModel, k: int, tolerance: float) -> dict[str, Any]:
    return {
        "scene": scene.config.name,
        "vertices": scene.mesh.vertices,
        "elements": sum(group.elements for group in scene.groups),
        "iterations": scene.config.iterations,
        "position_basis": model.position_basis,
        "k": k,
        "tau": tolerance,
        "method": ecsw_name(tolerance),
        "elements_sampled": model.elements_evaluated(scene),
    }


def _over_motions(errors: list[float | None]) -> dict[str, float]:
    known = [np.inf if error is None else error for error in errors]
    values = (np.median(known), min(known), max(known))
    return {
        f"relative_error_heldout{end}": v
        for end, v in zip(("", "_low", "_high"), values, strict=True)
    }


def relative_error(scene: Scene, model: SubspaceModel, reference: np.ndarray) -> float | None:
    """Relative error of a run of ``scene`` by ``model``, against ``reference`` (F + 1, N, 3).

    None if it blows up.
    """
    error = rerun_model(scene, model, reference).error(displacement_norms(reference))
    return error if error is not None and np.isfinite(error) else None
