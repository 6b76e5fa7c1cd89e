"""The mesh of a scene, checked."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pdrom.core.paths import MESH, File
from pdrom.core.reads import SourcesOf
from pdrom.experiments.kit.declaration import Experiment, JobSettings
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.types import save_mesh


class Settings(JobSettings):
    """What a mesh depends on."""

    mesh: MeshConfig


@dataclass(frozen=True)
class Inputs:
    """Files read: that of the mesh, nothing for a generated one."""

    sources: Annotated[list[str], SourcesOf("mesh")]


@dataclass(frozen=True)
class Outputs:
    """Files written."""

    mesh: Annotated[File, MESH]


def run(settings: Settings, inputs: Inputs, outputs: Outputs) -> None:
    """Build, check and save a mesh; MeshError names the fault. Jobs run in the project's folder."""
    config = settings.mesh
    mesh = check_mesh(config.build(Path()), config.label)
    save_mesh(mesh, outputs.mesh.path, {"label": config.label})


EXPERIMENT = Experiment("mesh", "Mesh {mesh}", run)
