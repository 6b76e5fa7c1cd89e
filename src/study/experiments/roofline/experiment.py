"""Rates of this machine, and the work of an iteration in every scene and mesh size."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.paths import MESH, RATES, WORK, File
from study.artifact.reads import Every, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import Count, Repeats, Solver
from study.experiments.roofline import rates as machine
from study.experiments.roofline import work as counts

log = logging.getLogger(__name__)

OWN_MESH = 1.0  # factor of a scene's own mesh


class Roofline(ConfigModel):
    """Section ``roofline``: how the machine's rates are measured, and the work counted.

    Reads go through working sets of up to ``largest_mb`` (MiB); every one of the ``repeats`` takes
    ``ms`` or more. Operations are counted in the first ``frames`` of each scene.
    """

    largest_mb: Annotated[int, Field(ge=1, le=65536)] = 256
    ms: Annotated[float, Field(gt=0.0, le=1000.0)] = 3.0
    repeats: Repeats = 15
    frames: Count = 10


class Options(ConfigModel):
    """Settings of rates and work."""

    every_scene: dict[str, SceneConfig]
    sizes: dict[str, tuple[float, ...]]
    roofline: Roofline
    solver: Solver


@experiment(
    "Rates of the machine, and the work of an iteration",
    reads={"meshes": Every(MESH), "settings": Settings(Options)},
    writes={"rates": RATES, "work": WORK},
    alone=True,
)
def roofline(meshes: list[File], settings: Options, rates: File, work: File) -> None:
    """Measure the machine, then count."""
    section = settings.roofline
    found = machine.rates(section.largest_mb * 2**20, 1e-3 * section.ms, section.repeats)
    write_table(pd.DataFrame(found, columns=machine.COLUMNS), rates.path)
    log.info("rates measured")
    rows: list[dict[str, Any]] = []
    for factor, scene in _scenes(settings, {file["mesh"]: file for file in meshes}):
        system = scene.system_with(settings.solver)
        counted = counts.work(scene, system, min(section.frames, scene.config.frames))
        rows += [{**row, "factor": factor} for row in counted]
        log.info("%s: %d vertices counted", scene.config.name, scene.mesh.vertices)
    write_table(pd.DataFrame(rows, columns=counts.COLUMNS), work.path)


def _scenes(settings: Options, meshes: dict[str, File]) -> Iterator[tuple[float, Scene]]:
    """Every scene on its own mesh, then on those with ``factor`` times the vertices a side."""
    for config in settings.every_scene.values():
        yield OWN_MESH, scene_of(config, meshes[config.mesh.identifier])
    for name, factors in settings.sizes.items():
        for factor in factors:
            if factor != OWN_MESH:
                config = settings.every_scene[name].coarsened(factor, 1.0)
                yield factor, Scene.build(config, config.mesh.build(Path()))
