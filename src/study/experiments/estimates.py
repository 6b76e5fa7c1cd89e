"""Estimated errors of all runs of a scene: their distances to the auxiliary model."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5, write_table
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import error_within
from pdrom.reduction.rerun import displacement_norms, mean_motion
from pdrom.reduction.subspace.companion import companion_run, estimate, largest_estimate
from pdrom.reduction.subspace.store import load_models
from study.artifact.paths import (
    COMPANION,
    ESTIMATES,
    FULL_ORDER,
    MESH,
    RERUNS,
    SENSITIVITY,
    SUBSPACES,
    TRAIN,
    File,
)
from study.artifact.reads import Every, Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.motion import Motion
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import Horizon

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "split",
    "relative_error_within_horizon", "estimate", "largest_estimate", "companion_error",
]  # fmt: skip


@dataclass(frozen=True)
class _Run:
    """A run of a reduced model: its labels, positions (F + 1, N, 3) m and norms by frame (F,)."""

    labels: dict[str, Any]
    positions: np.ndarray
    difference: np.ndarray
    displacement: np.ndarray


@experiment(
    "Estimated errors of the runs of {scene}",
    reads={
        "mesh": MESH,
        "train": TRAIN,
        "full_order": Every(FULL_ORDER),
        "model": COMPANION,
        "perturbed": SENSITIVITY,
        "reruns": Every(RERUNS),
        "subspaces": Every(SUBSPACES),
        "config": Setting("scene"),
        "horizon": Setting("horizon"),
    },
    writes={"out": ESTIMATES},
)
def estimates(
    mesh: File,
    train: File,
    full_order: list[File],
    model: File,
    perturbed: File,
    reruns: list[File],
    subspaces: list[File],
    config: SceneConfig,
    horizon: Horizon,
    out: File,
) -> None:
    """Run every motion with the auxiliary model and compare its runs with it.

    Those of reduced projections count where their positions are kept, see docs/formats.md.
    """
    ((_, companion),) = load_models(model.path)
    unit = mean_motion(positions_of(train))
    rows: list[dict[str, Any]] = []
    for run in full_order:
        split = run["run"]
        motion = Motion(scene_of(config, mesh, split), run)
        beside = companion_run(motion.scene, companion)
        end = horizon.frames(perturbed, split)
        own = _companion_error(beside, motion, end)
        for found in (*_local(reruns, split), *_inside(subspaces, split, motion)):
            error = error_within(found.difference, found.displacement, end)
            rows.append(
                {
                    **found.labels,
                    "split": split,
                    "relative_error_within_horizon": error,
                    "estimate": estimate(found.positions, beside, end),
                    "largest_estimate": largest_estimate(found.positions, beside, unit, end=end),
                    "companion_error": own,
                }
            )
        log.info("%s: own error of the auxiliary model %s", split, own)
    whole = {"k": "Int64", "r": "Int64"}
    write_table(pd.DataFrame(rows, columns=COLUMNS).astype(whole), out.path)


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
