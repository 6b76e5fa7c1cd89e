"""Ablation on one scene: why block DEIM fails in a position subspace, and what mends it."""

import logging
from collections.abc import Mapping
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from pdrom.artifact.reads import Settings
from pdrom.core.errors import SamplingError
from pdrom.core.paths import HELDOUT, MESH, SENSITIVITY, SUBSPACE_ABLATION, TRAIN, File
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.kit.declaration import experiment
from pdrom.experiments.kit.motion import Motion, training_positions
from pdrom.experiments.kit.scenes import SPLITS, scene_of
from pdrom.experiments.kit.settings import BlowupExtent, Horizon, Modes
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import error_within
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.specs import InterpolationSpec, InterpolationVariant

log = logging.getLogger(__name__)

POSITION_BASIS = "pod"
COLUMNS = [
    "scene", "group", "position_basis", "k", "r", "variant", "elements_sampled", "control_elements",
    "fallback_share", "heldout_fallback_share", "gain", "finite",
    "max_extent", "relative_error_within_horizon", "relative_error_full_projections",
    "heldout_error_within_horizon", "heldout_error_full_projections",
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
        "train": TRAIN,
        "heldout": HELDOUT,
        "sensitivity": SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={"out": SUBSPACE_ABLATION},
)
def subspace_ablation(
    mesh: File, train: File, heldout: File, sensitivity: File, settings: Options, out: File
) -> None:
    """Run every variant with all groups interpolated and write the table ``out``."""
    runs = {"train": train, "heldout": heldout}
    trials = _Trials(settings, mesh, runs, sensitivity)
    motion = trials.motions["train"]
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
    """Both motions of a scene with their horizons."""

    def __init__(
        self, settings: Options, mesh: File, runs: dict[str, File], sensitivity: File
    ) -> None:
        self._limit = settings.blowup_extent
        self.motions = {
            name: Motion(scene_of(settings.scene, mesh, name), run) for name, run in runs.items()
        }
        self._ends = {name: settings.horizon.frames(sensitivity, name) for name in SPLITS}

    def full_projections(self, columns: Columns) -> dict[str, Any]:
        """Errors of the runs without interpolation: what the subspace itself leaves."""
        model = SubspaceModel(POSITION_BASIS, columns)
        errors = {motion: self._run(motion, model)[1] for motion in SPLITS}
        return {
            "relative_error_full_projections": errors["train"],
            "heldout_error_full_projections": errors["heldout"],
        }

    def outcome(
        self, columns: Columns, trained: Training, spec: InterpolationSpec
    ) -> dict[str, Any]:
        """Outcome of a variant; a refused one has not run, and its cells are empty."""
        try:
            found = interpolate(self.motions["train"].scene, columns, trained, spec=spec)
        except SamplingError as error:
            log.info("refused: %s", error)
            return {}
        model = SubspaceModel(POSITION_BASIS, columns, found)
        outcome, within = self._run("train", model)
        heldout, heldout_within = self._run("heldout", model)
        return {
            "elements_sampled": model.elements_evaluated(self.motions["train"].scene),
            **_safeguard(found, outcome, heldout),
            "gain": max(chosen.gain for chosen in found.values()),
            "finite": outcome.finite,
            "max_extent": outcome.max_extent,
            "relative_error_within_horizon": within,
            "heldout_error_within_horizon": heldout_within,
        }

    def _run(self, motion: str, model: SubspaceModel) -> tuple[Rerun, float | None]:
        """A run and its error before the horizon; None if it did not get there."""
        case, end = self.motions[motion], self._ends[motion]
        outcome = case.run(model, self._limit)
        return outcome, error_within(outcome.difference, case.displacement, end)


def _safeguard(found: Mapping[str, Interpolation], train: Rerun, heldout: Rerun) -> dict[str, Any]:
    """Cells of a safeguard; empty without one."""
    control = [len(chosen.control) for chosen in found.values() if chosen.control is not None]
    if not control:
        return {}
    return {
        "control_elements": sum(control),
        "fallback_share": train.fallbacks / max(train.frames, 1),
        "heldout_fallback_share": heldout.fallbacks / max(heldout.frames, 1),
    }
