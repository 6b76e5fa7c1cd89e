"""Estimated errors of all runs of a scene: their distances to a companion, a finer model."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import h5py
import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.paths import (
    COMPANION,
    ESTIMATES,
    HELDOUT,
    MESH,
    RERUNS,
    SENSITIVITY,
    SUBSPACES,
    TRAIN,
    File,
)
from pdrom.core.reads import Every
from pdrom.core.store import open_hdf5, write_hdf5, write_table
from pdrom.experiments.declaration import Experiment, JobSettings
from pdrom.experiments.motion import Motion, training_indices, training_positions
from pdrom.experiments.scenes import RUNS, scene_of
from pdrom.experiments.settings import Horizon
from pdrom.model.runs.horizon import error_within
from pdrom.model.scene import SceneConfig
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.subspace.companion import (
    CompanionSpec,
    companion_model,
    companion_run,
    estimate,
)
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.store import load_models, store_columns, store_model

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "split",
    "relative_error_within_horizon", "estimate", "companion_error",
]  # fmt: skip


class Companion(CompanionSpec):
    """Section ``companion``: the companion, the estimate that is an alarm, tolerances of users."""

    alarm: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 0.15
    tolerances: tuple[Annotated[float, Field(gt=0.0, allow_inf_nan=False)], ...] = (0.1, 0.03, 0.01)


class Settings(JobSettings):
    """What the estimates of a scene depend on."""

    scene: SceneConfig
    companion: CompanionSpec
    horizon: Horizon


@dataclass(frozen=True)
class Inputs:
    """Files read; the held-out full-order run is there to judge the estimates only."""

    mesh: Annotated[File, MESH]
    train: Annotated[File, TRAIN]
    heldout: Annotated[File, HELDOUT]
    perturbed: Annotated[File, SENSITIVITY]
    reruns: Annotated[list[File], Every(RERUNS)]
    subspaces: Annotated[list[File], Every(SUBSPACES)]


@dataclass(frozen=True)
class Outputs:
    """Files written: the companion, and a row for every run of both motions."""

    model: Annotated[File, COMPANION]
    table: Annotated[File, ESTIMATES]


@dataclass(frozen=True)
class _Run:
    """A run of a reduced model: its labels, positions (F + 1, N, 3) m and norms by frame (F,)."""

    labels: dict[str, Any]
    positions: np.ndarray
    difference: np.ndarray
    displacement: np.ndarray


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Make the companion from the training motion and run both motions with it."""
    motions = {
        name: Motion(scene_of(settings.scene, inputs.mesh, name), getattr(inputs, name))
        for name in RUNS
    }
    train = motions["train"]
    frames = training_indices(train.scene)
    model = companion_model(train.scene, training_positions(train), frames, settings.companion)
    _store(model, settings, outputs.model)
    rows: list[dict[str, Any]] = []
    for split, motion in motions.items():
        companion = companion_run(motion.scene, model)
        end = settings.horizon.frames(inputs.perturbed, split)
        own = _companion_error(companion, motion, end)
        for found in (*_local(inputs.reruns, split), *_inside(inputs.subspaces, split, motion)):
            rows.append(
                {
                    **found.labels,
                    "split": split,
                    "relative_error_within_horizon": error_within(
                        found.difference, found.displacement, end
                    ),
                    "estimate": estimate(found.positions, companion, end),
                    "companion_error": own,
                }
            )
        log.info("%s: companion's own error %s", split, own)
    whole = {"k": "Int64", "r": "Int64"}
    write_table(pd.DataFrame(rows, columns=COLUMNS).astype(whole), outputs.table.path)


def _store(model: SubspaceModel, settings: Settings, place: File) -> None:
    labels = {"method": "ecsw", "position_basis": model.position_basis, "base": "companion"}
    with write_hdf5(place.path) as file:
        store_columns(file.create_group("columns/companion"), model.columns)
        store = file.create_group("models/companion")
        store_model(store, {**labels, "k": settings.companion.modes}, model.samples)


def _companion_error(companion: np.ndarray, motion: Motion, end: int) -> float | None:
    reference = motion.reference[1 : len(companion)]
    difference = np.linalg.norm((companion[1:] - reference).reshape(len(reference), -1), axis=1)
    return error_within(difference, displacement_norms(motion.reference), end)


def _local(files: list[File], split: str) -> Iterator[_Run]:
    """Runs whose positions are not reduced; sizes beyond the rank were not run."""
    for source in files:
        with open_hdf5(source.path) as file:
            store = file if split == "train" else file[split]
            for run in (run for name, run in store.items() if name.startswith("r")):
                if "positions" in run:
                    size = {"k": None, "r": int(run.attrs["r"])}
                    labels = {**source.labels, "position_basis": "full", **size}
                    positions = run["positions"][...].astype(np.float64)
                    yield _made(labels, positions, run, store["displacement"])


def _inside(files: list[File], split: str, motion: Motion) -> Iterator[_Run]:
    """Runs in position subspaces."""
    for source in files:
        models = load_models(source.path)
        with open_hdf5(source.path) as file:
            for labels, model in models:
                base = f"{labels['position_basis']}_k{labels['k']:03d}"
                run = file[f"models/{base}_{labels['method']}/{split}"]
                size = {"group": "all", "r": model.elements_evaluated(motion.scene)}
                positions = np.stack([model.positions(z) for z in run["coordinates"][...]])
                named = {**source.labels, **labels, **size}
                yield _made(named, positions, run, file[f"displacement/{split}"])


def _made(
    labels: dict[str, Any], positions: np.ndarray, run: h5py.Group, displacement: h5py.Dataset
) -> _Run:
    return _Run(labels, positions, run["difference"][...], displacement[...])


EXPERIMENT = Experiment("companion", "Estimated errors of the runs of {scene}", run)
