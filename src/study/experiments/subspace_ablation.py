"""Ablation on one scene: why block DEIM fails in a position subspace, and what mends it."""

import logging
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.errors import SamplingError
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import error_within
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.specs import InterpolationSpec, InterpolationVariant
from study.artifact.paths import FULL_ORDER, MESH, SENSITIVITY, SUBSPACE_ABLATION, File
from study.artifact.reads import Every, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.motion import Motion, training_positions
from study.experiments.kit.scenes import TRAIN as TRAINING
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes

log = logging.getLogger(__name__)

POSITION_BASIS = "pod"
COLUMNS = [
    "scene", "group", "position_basis", "k", "r", "variant", "elements_sampled", "control_elements",
    "fallback_share", "heldout_fallback_share", "gain", "finite",
    "max_extent", "relative_error_within_horizon", "relative_error_full_projections",
    "heldout_error_within_horizon", "heldout_error_low", "heldout_error_high",
    "heldout_error_full_projections",
]  # fmt: skip
Sizes = Annotated[tuple[Modes, ...], Field(min_length=1)]


class Ablation(ConfigModel):
    """Variants of the interpolation in a position subspace.

    sizes : modes k of the position basis
    modes : modes r of the projections
    variants : name -> interpolation
    """

    sizes: Sizes
    modes: Sizes
    variants: Annotated[dict[str, InterpolationVariant], Field(min_length=1)]

    def cases(self) -> list[tuple[str, InterpolationSpec]]:
        """(variant, interpolation) for every number of modes, in order."""
        return [
            (name, InterpolationSpec(modes=r, **variant.model_dump()))
            for r in self.modes
            for name, variant in self.variants.items()
        ]


class AblationFile(Ablation):
    """Content of config/subspace_ablation.yaml: the variants, and ``scenes`` where they run."""

    scenes: tuple[str, ...]


class Options(ConfigModel):
    """Settings of the ablation on a scene."""

    scene: SceneConfig
    ablation: Ablation
    horizon: Horizon
    blowup_extent: BlowupExtent


@experiment(
    "Variants of block DEIM in a position subspace of {scene}",
    reads={
        "mesh": MESH,
        "full_order": Every(FULL_ORDER),
        "sensitivity": SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={"out": SUBSPACE_ABLATION},
)
def subspace_ablation(
    mesh: File, full_order: list[File], sensitivity: File, settings: Options, out: File
) -> None:
    """Run every variant with all groups interpolated and write the table ``out``."""
    trials = _Trials(settings, mesh, full_order, sensitivity)
    motion = trials.motions[TRAINING]
    scene, training = motion.scene, training_positions(motion)
    rows = []
    for k in settings.ablation.sizes:
        columns = make_columns(scene, training, POSITION_BASIS, k=k)
        trained = Training(scene, columns, training)
        row = {
            "scene": scene.config.name,
            "group": ", ".join(group.name for group in scene.groups),
            "position_basis": POSITION_BASIS,
            "k": k,
            **trials.full_projections(columns),
        }
        for variant, spec in settings.ablation.cases():
            row = row | {"r": spec.modes, "variant": variant}
            rows.append(row | trials.outcome(columns, trained, spec))
            log.info("k = %d, r = %d, %s: %s", k, spec.modes, variant, rows[-1])
    table = pd.DataFrame(rows, columns=COLUMNS)
    table["finite"] = table["finite"].astype("boolean")
    table = table.astype({"elements_sampled": "Int64", "control_elements": "Int64"})
    write_table(table, out.path)


class _Trials:
    """Motions of a scene with their horizons, the training one first."""

    def __init__(self, settings: Options, mesh: File, runs: list[File], sensitivity: File) -> None:
        self._limit = settings.blowup_extent
        self.motions = {
            run["run"]: Motion(scene_of(settings.scene, mesh, run["run"]), run) for run in runs
        }
        self._ends = {name: settings.horizon.frames(sensitivity, name) for name in self.motions}

    def full_projections(self, columns: Columns) -> dict[str, Any]:
        """Errors of the runs without interpolation: what the subspace itself leaves."""
        model = SubspaceModel(POSITION_BASIS, columns)
        return {
            "relative_error_full_projections": self._run(TRAINING, model)[1],
            "heldout_error_full_projections": self._heldout(model)[1][0],
        }

    def outcome(
        self, columns: Columns, trained: Training, spec: InterpolationSpec
    ) -> dict[str, Any]:
        """Outcome of a variant; a refused one has not run, and its cells are empty."""
        try:
            found = interpolate(self.motions[TRAINING].scene, columns, trained, spec=spec)
        except SamplingError as error:
            log.info("refused: %s", error)
            return {}
        model = SubspaceModel(POSITION_BASIS, columns, found)
        outcome, within = self._run(TRAINING, model)
        heldout, (middle, low, high) = self._heldout(model)
        return {
            "elements_sampled": model.elements_evaluated(self.motions[TRAINING].scene),
            **_safeguard(found, outcome, heldout),
            "gain": max(chosen.gain for chosen in found.values()),
            "finite": outcome.finite,
            "max_extent": outcome.max_extent,
            "relative_error_within_horizon": within,
            "heldout_error_within_horizon": middle,
            "heldout_error_low": low,
            "heldout_error_high": high,
        }

    def _heldout(self, model: SubspaceModel) -> tuple[list[Rerun], list[float]]:
        """Runs of the held-out motions that can be judged; median, least and largest error."""
        chosen = [m for m, end in self._ends.items() if m != TRAINING and end != 0]
        runs, errors = zip(*(self._run(motion, model) for motion in chosen), strict=True)
        known = [np.inf if error is None else error for error in errors]
        return list(runs), [float(np.median(known)), min(known), max(known)]

    def _run(self, motion: str, model: SubspaceModel) -> tuple[Rerun, float | None]:
        """A run and its error before the horizon; None if it did not get there."""
        case, end = self.motions[motion], self._ends[motion]
        outcome = case.run(model, self._limit)
        return outcome, error_within(outcome.difference, case.displacement, end)


def _safeguard(
    found: Mapping[str, Interpolation], train: Rerun, heldout: list[Rerun]
) -> dict[str, Any]:
    """Cells of a safeguard; empty without one."""
    control = [len(chosen.control) for chosen in found.values() if chosen.control is not None]
    if not control:
        return {}
    return {
        "control_elements": sum(control),
        "fallback_share": train.fallbacks / max(train.frames, 1),
        "heldout_fallback_share": sum(run.fallbacks for run in heldout)
        / max(sum(run.frames for run in heldout), 1),
    }
