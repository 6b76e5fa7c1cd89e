"""Rule subspace_ablation: variants of block DEIM in a position subspace, on one scene."""

import logging
from typing import Any

import pandas as pd

from pdrom.core.errors import SamplingError
from pdrom.core.store import read_table, write_table
from pdrom.experiments.hyper import Motion, training_positions
from pdrom.experiments.scenes import RUNS, scene_of
from pdrom.experiments.subspace_ablation_spec import AblationSpec
from pdrom.model.runs.horizon import HELDOUT, error_within, floor_of, horizon
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.specs import InterpolationSpec

log = logging.getLogger(__name__)

POSITION_BASIS = "pod"
COLUMNS = [
    "scene", "group", "position_basis", "k", "r", "variant", "elements_sampled", "gain", "finite",
    "max_extent", "relative_error_within_horizon", "relative_error_full_projections",
    "heldout_error_within_horizon", "heldout_error_full_projections",
]  # fmt: skip


def ablate(
    scene: dict[str, Any],
    ablation: dict[str, Any],
    floor: dict[str, float],
    blowup_extent: float,
    mesh: str,
    runs: dict[str, str],
    sensitivity: str,
    output: str,
) -> None:
    """Run every variant with all groups interpolated and write the rows of subspace_ablation.

    Parameters
    ----------
    floor : perturbation and threshold that define the horizon
    runs : full-order runs of the training and of the held-out motion
    """
    spec = AblationSpec.model_validate(ablation)
    study = _Study(scene, floor, blowup_extent, mesh, runs, sensitivity)
    bound = study.motions["train"].scene
    training = training_positions(bound, study.motions["train"].reference)
    rows = []
    for k in spec.sizes:
        columns = make_columns(bound, training, POSITION_BASIS, k)
        trained = Training(bound, columns, training)
        row = {
            "scene": bound.config.name,
            "group": ", ".join(group.name for group in bound.groups),
            "position_basis": POSITION_BASIS,
            "k": k,
            **study.full_projections(columns),
        }
        for variant, settings in spec.cases():
            row = row | {"r": settings.modes, "variant": variant}
            rows.append(row | study.outcome(columns, trained, settings))
            log.info("k = %d, r = %d, %s: %s", k, settings.modes, variant, rows[-1])
    table = pd.DataFrame(rows, columns=COLUMNS)
    table["finite"] = table["finite"].astype("boolean")
    table["elements_sampled"] = table["elements_sampled"].astype("Int64")
    write_table(table, output)


class _Study:
    """Both motions of a scene with their horizons."""

    def __init__(
        self,
        scene: dict[str, Any],
        floor: dict[str, float],
        blowup_extent: float,
        mesh: str,
        runs: dict[str, str],
        sensitivity: str,
    ) -> None:
        self._limit = blowup_extent
        self.motions = {m: Motion(scene_of(scene, mesh, m), runs[m]) for m in RUNS}
        spread, name = read_table(sensitivity), scene["name"]
        labels = {"train": floor["perturbation"], "heldout": HELDOUT}
        self._ends = {
            motion: horizon(floor_of(spread, name, label), floor["threshold"])
            for motion, label in labels.items()
        }

    def full_projections(self, columns: Columns) -> dict[str, Any]:
        """Errors of the runs without interpolation: what the subspace itself leaves."""
        model = SubspaceModel(POSITION_BASIS, columns)
        errors = {motion: self._run(motion, model)[1] for motion in RUNS}
        return {
            "relative_error_full_projections": errors["train"],
            "heldout_error_full_projections": errors["heldout"],
        }

    def outcome(
        self, columns: Columns, trained: Training, settings: InterpolationSpec
    ) -> dict[str, Any]:
        """What a variant did; a refused one has not run, and its cells are empty."""
        try:
            found = interpolate(self.motions["train"].scene, columns, trained, settings)
        except SamplingError as error:
            log.info("refused: %s", error)
            return {}
        model = SubspaceModel(POSITION_BASIS, columns, found)
        run, error = self._run("train", model)
        return {
            "elements_sampled": sum(len(chosen.elements) for chosen in found.values()),
            "gain": max(chosen.gain for chosen in found.values()),
            "finite": run["blowup_frame"] is None,
            "max_extent": float(run["extent"].max(initial=0.0)),
            "relative_error_within_horizon": error,
            "heldout_error_within_horizon": self._run("heldout", model)[1],
        }

    def _run(self, motion: str, model: SubspaceModel) -> tuple[dict[str, Any], float | None]:
        """A run and its error before the horizon; None if it did not get there."""
        case, end = self.motions[motion], self._ends[motion]
        run = case.run(model, self._limit)
        return run, error_within(run["difference"], case.displacement, end)
