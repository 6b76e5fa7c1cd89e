"""A scene on a coarser mesh, the first way to a faster simulation, and the error of a mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from pdrom.core.errors import SceneError
from pdrom.model.dynamics.stepper import State
from pdrom.model.effects.base import effect_config
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import GeneratedMesh, GivenMesh
from pdrom.model.mesh.transfer import interpolation
from pdrom.model.mesh.types import Mesh
from pdrom.model.runs import converged_run
from pdrom.model.scene import Scene

ORDERS = (0.5, 3.0)  # observed orders of convergence for which `mesh_error` tells an error
CELLS = "triangles", "tetrahedra"
APART = 0.25  # part of the longest side by which the boxes of two meshes of a body may differ


@dataclass(frozen=True, eq=False)
class Coarser:
    """A scene on a coarser mesh, whose displacements are interpolated to a finer one.

    scene : the scene on the coarser mesh
    fine : the finer mesh
    matrix : (N, n) from values at the n coarse vertices to those at the N fine ones
    """

    scene: Scene
    fine: Mesh
    matrix: sparse.csr_array

    def positions(self, y: np.ndarray) -> np.ndarray:
        """Positions (N, 3) m of the fine vertices for ``y`` (n, 3) m of the coarse ones."""
        return self.fine.points + self.matrix @ (y - self.scene.mesh.points)

    @cached_property
    def _back(self) -> sparse.csr_array:
        return interpolation(self.fine, self.scene.mesh.points)

    def converged(self, tolerance: float, limit: int) -> np.ndarray | None:
        """Positions (F + 1, N, 3) m of the fine vertices in `converged_run` of the coarse scene."""
        run = converged_run(self.scene, tolerance, limit)
        return None if run is None else np.stack([self.positions(y) for y in run])

    def state(self, state: State) -> State:
        """Interpolate a ``state`` of the fine vertices at the coarse ones."""
        moved, velocities = state.positions - self.fine.points, state.velocities
        return State(self.scene.mesh.points + self._back @ moved, self._back @ velocities)


def on_mesh(scene: Scene, mesh: Mesh) -> Coarser:
    """Return ``scene`` on the coarser ``mesh``, with the same effects.

    A coarse vertex gets the masses of the fine ones in the shares in which these take its
    displacement, so that the mass and its centre stay.

    SceneError or MeshError if ``mesh`` is faulty, has no fewer vertices, fills another space, or
    has a vertex that no vertex of the scene is near to, or if an effect does not suit it.
    """
    own, where = scene.mesh, f"scene '{scene.config.name}': the coarser mesh"
    kinds = [CELLS[len(each.tetrahedra) > 0] for each in (mesh, own)]
    if mesh.vertices >= own.vertices or kinds[0] != kinds[1]:
        required = f"fewer than {own.vertices} vertices and {kinds[1]}"
        raise SceneError(f"{where} has {mesh.vertices} vertices and {kinds[0]}, not {required}")
    check_mesh(mesh, where)
    ends = [np.array([each.points.min(axis=0), each.points.max(axis=0)]) for each in (mesh, own)]
    if (apart := np.abs(ends[0] - ends[1]).max()) > APART * own.extent:
        raise SceneError(f"{where} ends {apart:.3g} m from the scene's: in another unit of length?")
    matrix = interpolation(mesh, own.points)
    masses = matrix.T @ scene.masses
    if not masses.min() > 0.0:
        fault = f"no vertex of the scene's mesh is near its vertex {int(masses.argmin())}"
        raise SceneError(f"{where}: {fault}: it needs larger elements everywhere")
    near = cKDTree(mesh.points).query(own.points)[1]
    effects = [_selecting(each.model_dump(), near) for each in scene.config.effects]
    found = tuple(effect_config(each, i) for i, each in enumerate(effects))
    changed = scene.config.model_copy(update={"mesh": GivenMesh.of(mesh), "effects": found})
    return Coarser(Scene.build(changed, mesh, masses), own, matrix)


def _selecting(keys: Any, near: np.ndarray, selects: bool = False) -> Any:
    """Return ``keys`` of an effect; a vertex v that they select by number becomes near[v]."""
    if isinstance(keys, dict):
        return {k: _selecting(v, near, k in ("select", "of")) for k, v in keys.items()}
    if not isinstance(keys, (list, tuple)):
        return keys
    if selects and all(isinstance(each, int) for each in keys):
        return np.unique(near[list(keys)]).tolist()
    return [_selecting(each, near, selects) for each in keys]


def grids(scene: Scene, parts: Sequence[float]) -> list[Coarser]:
    """Return ``scene`` on grids with these ``parts`` of its cells along a side, the finest first.

    Without a generated grid there are none; grids that are no coarser are left out.
    """
    config = scene.config.mesh
    if not isinstance(config, GeneratedMesh):
        return []
    made = {mesh.vertices: mesh for mesh in (config.with_cells(part) for part in parts)}
    coarser = sorted(size for size in made if size < scene.mesh.vertices)
    return [on_mesh(scene, made[size]) for size in reversed(coarser)]


def spacing(mesh: Mesh) -> float:
    """Mean spacing of the vertices of ``mesh``, in a unit that two meshes of a body share."""
    solid = len(mesh.tetrahedra)
    return float(solid ** (-1 / 3) if solid else len(mesh.triangles) ** (-1 / 2))


def mesh_error(spacings: Sequence[float], runs: Sequence[np.ndarray]) -> float | None:
    """Estimate the error of the finest of three meshes, relative to the motion, by Richardson.

    With an error C h^p of a mesh of spacing h, the differences of three runs tell C and p; None if
    the order p is outside `ORDERS`, or nothing moves.

    spacings : of three meshes, the finest first
    runs : (F + 1, N, 3) m each, converged, at the vertices of the finest mesh
    """
    first, second, third = spacings
    near, far = (float(np.linalg.norm(a - b)) for a, b in pairwise(runs))
    moved = float(np.linalg.norm(runs[0] - runs[0][0]))

    def excess(p: float) -> float:
        return (third**p - second**p) * near - (second**p - first**p) * far

    low, high = (excess(p) for p in ORDERS)
    if not moved or not low * high < 0.0:
        return None
    p = brentq(excess, *ORDERS)
    return near * first**p / (second**p - first**p) / moved


def error_of_mesh(
    run: np.ndarray | None, coarser: Sequence[Coarser], runs: Sequence[np.ndarray | None]
) -> float | None:
    """Estimate the relative error of the mesh of ``run``; None if unknown, see `mesh_error`.

    run : (F + 1, N, 3) m, converged, on the scene's mesh; None if it does not converge
    coarser, runs : coarser meshes, and converged runs on them at the scene's vertices, of which the
        first and the last are used
    """
    found = [run, *(runs[i] for i in (0, -1) if len(runs) > 1)]
    known = [each for each in found if each is not None]
    if len(known) < 3:
        return None
    meshes = [coarser[0].fine, coarser[0].scene.mesh, coarser[-1].scene.mesh]
    return mesh_error([spacing(mesh) for mesh in meshes], known)
