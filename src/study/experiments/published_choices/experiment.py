"""Reconstruction errors from this study's `published` to the published code, choice by choice."""

import logging
from collections.abc import Iterator
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.paths import MESH, PUBLISHED_CHOICES, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import Modes
from study.experiments.published_choices.choices import Case, Choice, Variant, variants
from study.experiments.published_choices.reconstruction import (
    Decomposed,
    decompose,
    errors,
    training_snapshots,
)
from study.experiments.published_choices.simulation import SIMULATION, applicable, projections

log = logging.getLogger(__name__)

COLUMNS = ["scene", "group", "experiment", "direction", "choice", "axis", "r", "error"]
# Choices on which the snapshots and their singular vectors depend.
DECOMPOSED: frozenset[Choice] = SIMULATION | {"frames", "weighting"}


class PublishedRuns(ConfigModel):
    """Choices and sizes that are compared.

    sizes : numbers of modes, ascending
    draws : how often the signs of the modes are drawn, and as often the rows among equal ones
    """

    sizes: Annotated[tuple[Modes, ...], Field(min_length=1)] = (1, 2, 3, 4, 5, 6, 8, 10, 15, 20)
    draws: Annotated[int, Field(ge=0, le=100)] = 8


class PublishedChoices(PublishedRuns):
    """Section ``published_choices``: ``cases`` have stored output of the published code."""

    cases: tuple[Case, ...] = ()


@experiment(
    "Choices of the published code for {group} in {scene}",
    reads={
        "mesh": MESH,
        "config": Setting("scene"),
        "runs": Setting("published_choices"),
        "published_experiment": Setting("published_experiment"),
    },
    writes={"out": PUBLISHED_CHOICES},
)
def published_choices(
    mesh: File,
    config: SceneConfig,
    runs: PublishedRuns,
    published_experiment: str,
    out: File,
) -> None:
    """Simulate, decompose and reconstruct with every variant."""
    labels = out.labels
    scene = scene_of(config, mesh)
    rows = []
    for variant, found, sizes in _variants(scene, labels["group"], runs):
        for axis, column in zip("xyz", found.T, strict=True):
            head = {
                **labels,
                "experiment": published_experiment,
                "direction": variant.direction,
            }
            head |= {"choice": variant.title, "axis": axis}
            rows += [{**head, "r": r, "error": e} for r, e in zip(sizes, column, strict=True)]
        log.info("%s, %s", variant.direction, variant.title)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _variants(
    scene: Scene, name: str, section: PublishedRuns
) -> Iterator[tuple[Variant, np.ndarray, list[int]]]:
    """Every variant with its errors (len(sizes), 3) and the sizes that its snapshots allow."""
    group, count = scene.group(name), scene.config.reduce[name].train
    sizes = [r for r in section.sizes if r <= count] or [count]
    runs: dict[frozenset[Choice], tuple[np.ndarray, np.ndarray]] = {}
    decomposed: dict[frozenset[Choice], Decomposed] = {}
    for variant in variants(applicable(scene, group), section.draws):
        simulated, key = variant.taken & SIMULATION, variant.taken & DECOMPOSED
        if simulated not in runs:
            runs[simulated] = projections(scene, name, simulated)
        if key not in decomposed:
            stored, row_sizes = runs[simulated]
            snapshots = training_snapshots(stored, count, variant.taken)
            decomposed[key] = decompose(snapshots, row_sizes, variant.taken)
        found = errors(decomposed[key], group.rows_per_element, sizes, variant=variant)
        yield variant, found, sizes
