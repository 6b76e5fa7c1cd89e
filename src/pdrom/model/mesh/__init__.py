"""Meshes: generators, files, checks, vertex selections."""

from pdrom.model.mesh.types import Mesh, load_mesh, save_mesh

__all__ = ["Mesh", "load_mesh", "save_mesh"]
