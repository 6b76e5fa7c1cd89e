"""Declare experiments, define settings that several of them share, and load scenes.

The sensitivity of a scene is the relative difference, in each frame, between its full-order run and
a run from slightly displaced initial positions; it is the largest over several random displacements
(`floor_of`). The predictability horizon is the first frame in which the sensitivity exceeds a
threshold. From this frame on, errors of reduced runs do not show how accurate a method is.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, cast

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import open_hdf5, read_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.held_out import HeldOutMotion
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.paths import File, Place
from study.artifact.reads import Read


class Experiment(Artifact):
    """An artifact whose function writes files; functions of tables and figures return content."""


def experiment(
    title: str, *, reads: Mapping[str, Read], writes: Mapping[str, Place], alone: bool = False
) -> Callable[[Callable[..., None]], Experiment]:
    """Return a decorator that declares a function as an experiment (`Artifact`).

    ``title`` is the message of its jobs. With ``alone``, no other job runs at the same time. Raises
    TypeError if the parameters of the function are not the names in ``reads`` and ``writes``.
    """

    def decorate(function: Callable[..., Any]) -> Experiment:
        made = Experiment(function.__name__, title, reads, writes, function, alone)
        return declare(made, *writes)

    return decorate


def experiments() -> dict[str, Experiment]:
    """Return a mapping of names to all experiments of the study."""
    return declared_in("study.experiments", Experiment)


TRAIN = "train"
FOM = "fom"  # method in tables: full-order run, with the scene's or another number of iterations
ANDERSON = "fom-anderson"  # method in tables: full-order run with Anderson acceleration

# names of the phases of a frame that belong to no effect
RIGHT, GLOBAL, REST = "right-hand side", "global solve", "rest of the frame"
Count = Annotated[int, Field(ge=1, le=100_000)]
Repeats = Annotated[int, Field(ge=1, le=1000)]
Modes = Annotated[int, Field(ge=1, le=1000)]
Parts = tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...]
PARTS = (1 / 2, 1 / 3, 1 / 4)  # cells along a side of coarser meshes, relative to the scene's mesh
Tolerance = Annotated[float, Field(gt=0.0, lt=1.0)]
# Name of a scene -> factors by which the vertex count along each side of its mesh is multiplied.
Sizes = dict[str, tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...]]
PositionBasis = Literal["pod", "skinning"]
Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]


class OfScene(ConfigModel):
    """Base class of settings for one file, whose path contains all settings that are texts."""

    scene: SceneName

    @property
    def labels(self) -> dict[str, str]:
        """All text settings (scene, group ...) by name; the file's path contains their values."""
        return {name: text for name, text in self if isinstance(text, str)}


def floor_of(table: pd.DataFrame, scene: str, perturbation: float | str) -> np.ndarray:
    """Return the sensitivity (F,) of a scene, by frame, for a size or name of the perturbation.

    The ``table`` of perturbed runs has columns scene, perturbation, frame and relative_difference.
    The sensitivity is the largest difference over all seeds; it is empty without perturbed runs.
    """
    label = perturbation if isinstance(perturbation, str) else f"{perturbation:g}"
    # if all perturbations are numbers, pandas has read the column as floats
    rows = table[(table.scene == scene) & (table.perturbation.astype(str) == label)]
    return rows.groupby("frame").relative_difference.max().to_numpy(float)


def horizon(floor: np.ndarray, threshold: float) -> int:
    """Return the first frame in which the sensitivity (F,) exceeds ``threshold``; F if none."""
    above = np.flatnonzero(~(floor <= threshold))
    return int(above[0]) if len(above) else len(floor)


def horizons(table: pd.DataFrame, perturbation: float | str, threshold: float) -> dict[str, int]:
    """Map scenes to the first frame in which the sensitivity exceeds ``threshold``."""
    scenes = table.scene.unique()
    return {s: horizon(floor_of(table, s, perturbation), threshold) for s in scenes}


class Horizon(ConfigModel):
    """Settings of the predictability horizon of a scene; only frames before it are compared.

    It is the first frame that a ``perturbation`` of the start changes by more than ``threshold``.
    """

    perturbation: Tolerance
    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

    def frames(self, perturbed: File, motion: str = TRAIN) -> int:
        """Count the frames before runs in file ``perturbed`` differ by more than `threshold`."""
        label = self.perturbation if motion == TRAIN else motion
        spread = floor_of(read_table(perturbed.path), perturbed["scene"], label)
        return horizon(spread, self.threshold)


def resolve_ranks(ranks: Sequence[Rank], rank: int) -> list[int]:
    """Sort basis sizes ``ranks``; "full" becomes the numerical ``rank`` (left out if it is 0)."""
    full = [rank] if "full" in ranks and rank > 0 else []
    return sorted({*(int(r) for r in ranks if r != "full"), *full})


def scene_of(config: SceneConfig, mesh: File, run: str = TRAIN) -> Scene:
    """Build the scene of ``config`` on its mesh; ``run`` is "train" or a test trajectory."""
    chosen = config if run == TRAIN else config.heldout_variant(cast(HeldOutMotion, run))
    scene = Scene.build(chosen, load_mesh(mesh.path))
    scene.log_holds()
    return scene


def positions_of(run: File, frames: int | None = None) -> np.ndarray:
    """Read positions (F + 1, N, 3) m of a full-order run, or only of its first ``frames``."""
    with open_hdf5(run.path) as file:
        return file["positions"][: None if frames is None else frames + 1]


def perturbation_field(scene: Scene, size: float, seed: int) -> np.ndarray:
    """Draw random vectors (N, 3) m by ``seed``, each ``size`` times the mesh's extent long."""
    field = np.random.default_rng(seed).standard_normal((scene.mesh.vertices, 3))
    return size * scene.mesh.extent * field / np.linalg.norm(field, axis=1, keepdims=True)


def varied(
    config: SceneConfig, time_step: float, stiffness_ratio: float, duration: float,
    frames: Sequence[int],
) -> SceneConfig:  # fmt: skip
    """Return ``config`` with another ``time_step`` (s) and other weights of reduced groups.

    The weights are multiplied by ``stiffness_ratio``. Effects begin and end at the same times in s.
    The run lasts ``duration`` seconds, in ``frames[0]`` to ``frames[1]`` frames.
    """
    count = min(max(round(duration / time_step), frames[0]), frames[1])
    effects = []
    for effect in config.effects:
        effect = effect.with_frames_scaled(config.time_step / time_step)
        if isinstance(effect, GroupConfig) and effect.effect in config.reduce:
            effect = effect.model_copy(update={"weight": stiffness_ratio * effect.weight})
        effects.append(effect)
    # numbers of training snapshots and other settings of the reduction stay unchanged
    changes = {"time_step": time_step, "frames": count, "effects": tuple(effects)}
    return config.model_copy(update=changes)
