"""Declaration of an experiment, settings that several share and scenes from files.

An experiment is a question that the study asks, with files as the answer.

The floor of a scene is how far its full-order run drifts when the start is moved a little, by frame
and over all seeds (`study.experiments.sensitivity`). From the horizon on the floor exceeds a
threshold, and a difference between two runs says nothing about their methods.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, cast

import numpy as np
import pandas as pd
from pydantic import AfterValidator, Field

from pdrom.core.store import open_hdf5, read_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.held_out import HeldOutMotion
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.paths import File, Place
from study.artifact.reads import Read


class Experiment(Artifact):
    """An artifact whose function writes its files itself."""


def experiment(
    title: str, *, reads: Mapping[str, Read], writes: Mapping[str, Place], alone: bool = False
) -> Callable[[Callable[..., None]], Experiment]:
    """Declare the function below as an experiment, see `Artifact`.

    ``title`` names its jobs; nothing runs at the same time as those of an ``alone`` one.

    Raises
    ------
    TypeError
        If the function does not take what it reads and writes.
    """

    def decorate(function: Callable[..., Any]) -> Experiment:
        made = Experiment(function.__name__, title, reads, writes, function, alone)
        return declare(made, *writes)

    return decorate


def experiments() -> dict[str, Experiment]:
    """Return every experiment of the study by name."""
    return declared_in("study.experiments", Experiment)


FOM = "fom"  # the full-order run with its own or another number of iterations
ANDERSON = "fom-anderson"  # the same with accelerated iterations

# phases of a frame other than effects
RIGHT, GLOBAL, REST = "right-hand side", "global solve", "rest of the frame"
# a run ends when its bounding box exceeds this multiple of the rest extent
BlowupExtent = Annotated[float, Field(gt=1.0, le=1e12)]
Count = Annotated[int, Field(ge=1, le=100_000)]
Repeats = Annotated[int, Field(ge=1, le=1000)]
Modes = Annotated[int, Field(ge=1, le=1000)]
Tolerance = Annotated[float, Field(gt=0.0, lt=1.0)]
# factors on the vertices along a side, for scenes by name
Sizes = dict[str, tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...]]
PositionBasis = Literal["pod", "skinning"]
Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]


class OfScene(ConfigModel):
    """Names files of a scene."""

    scene: SceneName

    @property
    def labels(self) -> dict[str, str]:
        """Labels of the files: every text in these settings."""
        return {name: text for name, text in self if isinstance(text, str)}


def floor_of(table: pd.DataFrame, scene: str, perturbation: float | str) -> np.ndarray:
    """Sensitivity floor (F,) of a scene at one size (or under one label) of the perturbation.

    Empty if the scene was not perturbed in this way.

    Parameters
    ----------
    table : perturbed runs with scene, perturbation, frame and relative_difference; seeds may be
        rows of their own or joined
    """
    label = perturbation if isinstance(perturbation, str) else f"{perturbation:g}"
    # a column without words is read from a file as numbers
    rows = table[(table.scene == scene) & (table.perturbation.astype(str) == label)]
    return rows.groupby("frame").relative_difference.max().to_numpy(float)


def horizon(floor: np.ndarray, threshold: float) -> int:
    """First frame at which the floor (F,) exceeds ``threshold``; F if it never does."""
    above = np.flatnonzero(~(floor <= threshold))
    return int(above[0]) if len(above) else len(floor)


def horizons(table: pd.DataFrame, perturbation: float | str, threshold: float) -> dict[str, int]:
    """`horizon` of every scene of the table by ``threshold``, see `floor_of` (``perturbation``)."""
    scenes = table.scene.unique()
    return {s: horizon(floor_of(table, s, perturbation), threshold) for s in scenes}


def _known(solver: str) -> str:
    if solver not in SOLVERS:
        raise ValueError(f"allowed are {', '.join(SOLVERS)}")
    return solver


Solver = Annotated[str, AfterValidator(_known)]


class Horizon(ConfigModel):
    """Up to which frame a run is judged: the spread of the runs perturbed by ``perturbation``.

    The horizon is the first frame at which the spread exceeds ``threshold``.
    """

    perturbation: Tolerance
    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

    def frames(self, perturbed: File) -> int:
        """Frames before the horizon of a scene, from the table of its perturbed runs."""
        spread = floor_of(read_table(perturbed.path), perturbed["scene"], self.perturbation)
        return horizon(spread, self.threshold)


def resolve_ranks(ranks: Sequence[Rank], rank: int) -> list[int]:
    """``ranks`` ascending, "full" replaced by the numerical ``rank`` (left out if 0)."""
    full = [rank] if "full" in ranks and rank > 0 else []
    return sorted({*(int(r) for r in ranks if r != "full"), *full})


TRAIN = "train"


def scene_of(config: SceneConfig, mesh: File, run: str = TRAIN) -> Scene:
    """Scene of ``config`` and ``run`` ("train" or a held-out motion) on its mesh file."""
    chosen = config if run == TRAIN else config.heldout_variant(cast(HeldOutMotion, run))
    scene = Scene.build(chosen, load_mesh(mesh.path))
    scene.log_holds()
    return scene


def positions_of(run: File, frames: int | None = None) -> np.ndarray:
    """Positions (F + 1, N, 3) m of a full-order run, or of its first ``frames``."""
    with open_hdf5(run.path) as file:
        return file["positions"][: None if frames is None else frames + 1]


def followed(loop: Stepper, state: State, frames: int) -> np.ndarray:
    """Positions (F + 1, N, 3) m that ``loop`` reaches from ``state`` on, the first ones first."""
    ends = [after.positions for after, _ in loop.run(state, range(frames))]
    return np.stack([state.positions, *ends])


def perturbation_field(scene: Scene, size: float, seed: int) -> np.ndarray:
    """Random directions by ``seed``, of length ``size`` times the extent of ``scene``, (N, 3) m."""
    field = np.random.default_rng(seed).standard_normal((scene.mesh.vertices, 3))
    return size * scene.mesh.extent * field / np.linalg.norm(field, axis=1, keepdims=True)


def varied(
    config: SceneConfig,
    time_step: float,
    stiffness_ratio: float,
    duration: float,
    frames: Sequence[int],
) -> SceneConfig:
    """``config`` with ``time_step`` (s) and the reduced groups' weights times ``stiffness_ratio``.

    Schedules keep their times in seconds, so that their frame numbers change. The run takes
    ``duration`` seconds, but at least ``frames[0]`` and at most ``frames[1]`` frames. The other
    groups keep their weights.
    """
    count = min(max(round(duration / time_step), frames[0]), frames[1])
    effects = []
    for effect in config.effects:
        effect = effect.with_frames_scaled(config.time_step / time_step)
        if isinstance(effect, GroupConfig) and effect.effect in config.reduce:
            effect = effect.model_copy(update={"weight": stiffness_ratio * effect.weight})
        effects.append(effect)
    # the experiments, with their numbers of training snapshots, belong to the original run
    changes = {"time_step": time_step, "frames": count, "effects": tuple(effects)}
    return config.model_copy(update=changes)
