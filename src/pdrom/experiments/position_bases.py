"""How well each position subspace could follow a motion, beside how well its run does."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from scipy import linalg

from pdrom.core.paths import (
    HELDOUT,
    MESH,
    POSITION_BASES,
    SENSITIVITY,
    SUBSPACES,
    TRAIN,
    File,
)
from pdrom.core.store import open_hdf5, write_table
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.horizon import error_within
from pdrom.experiments.kit.motion import Motion
from pdrom.experiments.kit.scenes import RUNS, scene_of
from pdrom.experiments.kit.settings import Horizon
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.store import load_models

COLUMNS = [
    "scene", "split", "position_basis", "k", "best_approximation", "relative_error_within_horizon",
    "full_order_out_of_plane", "out_of_plane",
]  # fmt: skip
# A rest shape that is thinner than this fraction of its extent is flat.
FLAT = 1e-9


class Settings(JobSettings):
    """What the rows of a scene depend on."""

    scene: SceneConfig
    horizon: Horizon


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]
    train: Annotated[File, TRAIN]
    heldout: Annotated[File, HELDOUT]
    perturbed: Annotated[File, SENSITIVITY]
    subspaces: Annotated[File, SUBSPACES]


@dataclass(frozen=True)
class Outputs:
    """Files written: a row for every subspace and motion."""

    table: Annotated[File, POSITION_BASES]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Compare the runs with full projections with the best positions in their subspace."""
    rows: list[dict[str, Any]] = []
    for split in RUNS:
        scene = scene_of(settings.scene, inputs.mesh, split)
        motion = Motion(scene, getattr(inputs, split))
        end = settings.horizon.frames(inputs.perturbed, split)
        rows += _rows(motion, inputs.subspaces, split, end)
    write_table(pd.DataFrame(rows, columns=COLUMNS), outputs.table.path)


def _rows(motion: Motion, source: File, split: str, end: int) -> Iterator[dict[str, Any]]:
    name, normal = motion.scene.config.name, flat_axis(motion.scene.mesh.points)
    models = [
        (labels, model) for labels, model in load_models(source.path) if labels["method"] == "full"
    ]
    with open_hdf5(source.path) as file:
        for labels, model in models:
            kind, k = labels["position_basis"], labels["k"]
            store = file[f"models/{kind}_k{k:03d}_full/{split}"]
            positions = np.einsum("nk,fka->fna", model.columns.B, store["coordinates"][...])
            best = best_differences(model.columns.B, motion.reference[1:])
            yield {
                "scene": name,
                "split": split,
                "position_basis": kind,
                "k": k,
                "best_approximation": error_within(best, motion.displacement, end),
                "relative_error_within_horizon": error_within(
                    store["difference"][...], motion.displacement, end
                ),
                "full_order_out_of_plane": out_of_plane(motion.reference, normal, end),
                "out_of_plane": out_of_plane(positions, normal, end),
            }


def best_differences(columns: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Distance (F,) of each frame of positions (F, N, 3) to the span of columns (N, K), m."""
    q = linalg.qr(columns, mode="economic")[0]
    inside = np.einsum("nk,fka->fna", q, np.einsum("nk,fna->fka", q, positions))
    return np.linalg.norm((positions - inside).reshape(len(positions), -1), axis=1)


def flat_axis(points: np.ndarray) -> int | None:
    """Axis in which the rest shape (N, 3) has no thickness; None if there is none."""
    sides = np.ptp(points, axis=0)
    thinnest = int(np.argmin(sides))
    return thinnest if sides[thinnest] <= FLAT * sides.max() else None


def out_of_plane(positions: np.ndarray, normal: int | None, end: int) -> float | None:
    """Share of the motion (F + 1, N, 3) along an axis, by its norm over the frames before ``end``.

    None without an axis, a frame or a motion.
    """
    moved = positions[1 : end + 1] - positions[0]
    whole = float(np.linalg.norm(moved))
    if normal is None or whole == 0.0:
        return None
    return float(np.linalg.norm(moved[..., normal])) / whole


EXPERIMENT = Experiment("position_bases", "What the position subspaces of {scene} can hold", run)
