"""Hypothesis strategies for hard meshes."""

import numpy as np
from hypothesis import strategies as st

from pdrom.model.mesh.generators import bar, boundary, cloth
from pdrom.model.mesh.types import Mesh

SEEDS = st.integers(0, 2**32 - 1)


@st.composite
def cells(draw, corners: int, quality: float) -> np.ndarray:
    """Corners (corners, 3) of a triangle or tetrahedron, anywhere, in any direction and size.

    The last corner lies ``quality`` edge lengths off the line or plane of the others.
    """
    rng = np.random.default_rng(draw(SEEDS))
    frame, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    inside = rng.uniform(0.2, 1.0, (1, corners - 2))
    base = np.vstack([np.zeros(corners - 2), np.eye(corners - 2), inside])
    flat = np.zeros((corners, 3))
    flat[:, : corners - 2] = base
    flat[-1, corners - 2] = quality
    size = 10.0 ** draw(st.floats(-3, 3))
    return size * (flat @ frame.T)


@st.composite
def wild_meshes(draw, kind: str) -> Mesh:
    """A sheet or bar whose vertices have been moved by up to a third of a cell, and scaled."""
    mesh = cloth(4, 5, "xz") if kind == "sheet" else bar(4, 3, 3)
    rng = np.random.default_rng(draw(SEEDS))
    cell = mesh.extent / (4 if kind == "sheet" else 3)
    noise = draw(st.floats(0.0, 0.3)) * cell
    points = mesh.points + noise * rng.uniform(-1.0, 1.0, mesh.points.shape)
    points = points * 10.0 ** draw(st.floats(-3, 3))
    if kind == "sheet":
        return Mesh(points, mesh.triangles)
    return Mesh(points, boundary(mesh.tetrahedra), mesh.tetrahedra)
