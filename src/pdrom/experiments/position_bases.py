"""Best approximation of a motion in each position subspace, beside the error of its run."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from scipy import linalg

from pdrom.artifact.reads import Every, Setting
from pdrom.core.paths import FULL_ORDER, MESH, POSITION_BASES, SENSITIVITY, SUBSPACES, File
from pdrom.core.store import open_hdf5, write_table
from pdrom.experiments.kit.declaration import experiment
from pdrom.experiments.kit.motion import Motion
from pdrom.experiments.kit.scenes import scene_of
from pdrom.experiments.kit.settings import Horizon
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import error_within
from pdrom.reduction.subspace.store import load_models

COLUMNS = [
    "scene", "split", "position_basis", "k", "best_approximation", "relative_error_within_horizon",
    "full_order_out_of_plane", "out_of_plane",
]  # fmt: skip
# A rest shape that is thinner than this fraction of its extent is flat.
FLAT = 1e-9


@experiment(
    "What the position subspaces of {scene} can hold",
    reads={
        "mesh": MESH,
        "full_order": Every(FULL_ORDER),
        "perturbed": SENSITIVITY,
        "subspaces": SUBSPACES,
        "config": Setting("scene"),
        "horizon": Setting("horizon"),
    },
    writes={"out": POSITION_BASES},
)
def position_bases(
    mesh: File,
    full_order: list[File],
    perturbed: File,
    subspaces: File,
    config: SceneConfig,
    horizon: Horizon,
    out: File,
) -> None:
    """Compare the runs with full projections with the best positions in their subspace."""
    rows: list[dict[str, Any]] = []
    for run in full_order:
        split = run["run"]
        motion = Motion(scene_of(config, mesh, split), run)
        end = horizon.frames(perturbed, split)
        rows += _rows(motion, subspaces, split, end)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


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
    """Axis in which the rest shape ``points`` (N, 3) has no thickness; None if there is none."""
    sides = np.ptp(points, axis=0)
    thinnest = int(np.argmin(sides))
    return thinnest if sides[thinnest] <= FLAT * sides.max() else None


def out_of_plane(positions: np.ndarray, normal: int | None, end: int) -> float | None:
    """Share of ``positions`` (F + 1, N, 3) that move along ``normal``, by the norm before ``end``.

    None without an axis, a frame or a motion.
    """
    moved = positions[1 : end + 1] - positions[0]
    whole = float(np.linalg.norm(moved))
    if normal is None or whole == 0.0:
        return None
    return float(np.linalg.norm(moved[..., normal])) / whole
