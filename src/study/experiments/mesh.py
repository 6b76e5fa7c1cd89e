"""The mesh of a scene, checked."""

from pathlib import Path

from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.types import save_mesh
from study.artifact.paths import MESH, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.kit.declaration import experiment


@experiment(
    "Mesh {mesh}",
    reads={"sources": SourcesOf("mesh"), "config": Setting("mesh")},
    writes={"out": MESH},
)
def mesh(sources: list[Path], config: MeshConfig, out: File) -> None:
    """Build the mesh of ``config`` with its ``sources``, check it and save it to ``out``.

    MeshError names the fault. Jobs run in the project's folder.
    """
    made = check_mesh(config.build(Path()), config.label)
    save_mesh(made, out.path, {"label": config.label})
