"""Rule mesh: configuration -> checked mesh file."""

from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.types import save_mesh


def make_mesh(config: dict[str, Any], root: Path, output: str) -> None:
    """Build, check and save a mesh; MeshError names the fault."""
    mesh_config = TypeAdapter(MeshConfig).validate_python(config)
    mesh = check_mesh(mesh_config.build(root), mesh_config.label)
    save_mesh(mesh, output, {"label": mesh_config.label})
