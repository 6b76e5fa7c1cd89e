"""Drift of runs of a scene that should be the same, and what its effects do in it."""

from typing import Annotated, Self

import pandas as pd
from pydantic import Field, model_validator

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.effects.base import Seed
from pdrom.model.held_out import MOTIONS
from pdrom.model.scene import SceneConfig
from study.artifact.paths import CONTRIBUTIONS, MESH, SENSITIVITY, File
from study.artifact.reads import Setting
from study.experiments.kit.contributions import contributions
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.sensitivity import heldout_floor, sensitivities

Perturbation = Annotated[float, Field(gt=0.0, lt=1.0)]


class PerturbedRuns(ConfigModel):
    """Starts moved by ``perturbations`` times the extent, each with every seed.

    ``reference`` is the perturbation that defines the horizon, and that of held-out motions.
    """

    perturbations: tuple[Perturbation, ...] = (1e-12, 1e-10, 1e-8)
    reference: Perturbation = 1e-10
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1, 2, 3)

    @model_validator(mode="after")
    def _reference_is_run(self) -> Self:
        if self.reference not in self.perturbations:
            raise ValueError(f"reference = {self.reference}: must be one of the perturbations")
        return self


class Sensitivity(PerturbedRuns):
    """Section ``sensitivity``: ``threshold`` is the relative difference that ends the horizon."""

    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1e-3


@experiment(
    "Perturbed full-order runs of {scene}",
    reads={"mesh": MESH, "config": Setting("scene"), "chosen": Setting("sensitivity")},
    writes={"out": SENSITIVITY, "effects": CONTRIBUTIONS},
)
def sensitivity(
    mesh: File, config: SceneConfig, chosen: PerturbedRuns, out: File, effects: File
) -> None:
    """Write differences of a scene's perturbed runs, and of its held-out motions, to ``out``."""
    scene = scene_of(config, mesh)
    table = sensitivities(scene, chosen.perturbations, chosen.seeds)
    heldout = [
        heldout_floor(scene_of(config, mesh, motion), motion, chosen.reference, chosen.seeds)
        for motion in MOTIONS
    ]
    write_table(pd.concat([table, *heldout], ignore_index=True), out.path)
    write_table(contributions(scene), effects.path)
