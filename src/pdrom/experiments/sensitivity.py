"""How far runs of a scene drift apart that should be the same, and what its effects do in it."""

from dataclasses import dataclass
from typing import Annotated, Self

import pandas as pd
from pydantic import Field, model_validator

from pdrom.core.paths import CONTRIBUTIONS, MESH, SENSITIVITY, File
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.kit.contributions import contributions
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.experiments.kit.scenes import scene_of
from pdrom.experiments.kit.sensitivity import heldout_floor, sensitivity
from pdrom.model.effects.base import Seed
from pdrom.model.scene import SceneConfig

Perturbation = Annotated[float, Field(gt=0.0, lt=1.0)]


class PerturbedRuns(ConfigModel):
    """Starts moved by ``perturbations`` times the extent, each with every seed.

    ``reference`` is the perturbation that defines the horizon, and that of the held-out motion.
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


class Settings(JobSettings):
    """What the perturbed runs of a scene depend on."""

    scene: SceneConfig
    sensitivity: PerturbedRuns


@dataclass(frozen=True)
class Inputs:
    """Files read."""

    mesh: Annotated[File, MESH]


@dataclass(frozen=True)
class Outputs:
    """Files written: differences of all seeds, and forces of all effects, frame by frame."""

    table: Annotated[File, SENSITIVITY]
    contributions: Annotated[File, CONTRIBUTIONS]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Write the differences of a scene's perturbed runs, and of its held-out motion."""
    chosen, scene = settings.sensitivity, scene_of(settings.scene, inputs.mesh)
    table = sensitivity(scene, chosen.perturbations, chosen.seeds)
    motion = scene_of(settings.scene, inputs.mesh, "heldout")
    heldout = heldout_floor(motion, chosen.reference, chosen.seeds)
    write_table(pd.concat([table, heldout], ignore_index=True), outputs.table.path)
    write_table(contributions(scene), outputs.contributions.path)


EXPERIMENT = Experiment("sensitivity", "Perturbed full-order runs of {scene}", run)
