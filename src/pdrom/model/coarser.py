"""A scene on a coarser mesh, interpolation between the meshes, and the error due to a mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise
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
from pdrom.model.mesh.types import Mesh
from pdrom.model.runs import converged_run
from pdrom.model.scene import Scene

ORDERS = (0.5, 3.0)  # observed orders of convergence for which `mesh_error` returns an error
CELLS = "triangles", "tetrahedra"
APART = 0.25  # fraction of the longest side by which bounding boxes of both meshes may differ
FIRST = 16  # number of elements with the nearest centres that are tried first for a point
PAIRS = 1 << 18  # largest number of points times elements that are compared at a time
INSIDE = 1e-9  # fraction of the longest side up to which a point near an element lies in it


@dataclass(frozen=True, eq=False)
class Coarser:
    """A scene on a coarser mesh, whose displacements are interpolated to a finer one.

    scene : the scene on the coarser mesh
    fine : the finer mesh
    matrix : (N, n) interpolation of values at the n coarse vertices to the N fine vertices
    """

    scene: Scene
    fine: Mesh
    matrix: sparse.csr_array

    def positions(self, y: np.ndarray) -> np.ndarray:
        """Return positions (N, 3) m of fine vertices, given ``y`` (n, 3) m of coarse vertices."""
        return self.fine.points + self.matrix @ (y - self.scene.mesh.points)

    @cached_property
    def _back(self) -> sparse.csr_array:
        return interpolation(self.fine, self.scene.mesh.points)

    def converged(self, tolerance: float, limit: int) -> np.ndarray | None:
        """Return `converged_run` of the coarse scene at the fine vertices, (F + 1, N, 3) m."""
        run = converged_run(self.scene, tolerance, limit)
        return None if run is None else np.stack([self.positions(y) for y in run])

    def state(self, state: State) -> State:
        """Interpolate a ``state`` of the fine vertices at the coarse vertices."""
        moved, velocities = state.positions - self.fine.points, state.velocities
        return State(self.scene.mesh.points + self._back @ moved, self._back @ velocities)


def on_mesh(scene: Scene, mesh: Mesh) -> Coarser:
    """Return ``scene`` on the coarser ``mesh``, with the same effects.

    The mass of each fine vertex is divided among coarse vertices by its interpolation weights,
    which preserves the total mass and its centre.

    SceneError or MeshError if ``mesh`` is faulty, has no fewer vertices, has another bounding box,
    has a vertex that is near no vertex of the scene, or if an effect does not suit it.
    """
    own, where = scene.mesh, f"scene '{scene.config.name}': the coarser mesh"
    kinds = [CELLS[len(each.tetrahedra) > 0] for each in (mesh, own)]
    if mesh.vertices >= own.vertices or kinds[0] != kinds[1]:
        required = f"required are fewer than {own.vertices} vertices and {kinds[1]}"
        raise SceneError(f"{where} has {mesh.vertices} vertices and {kinds[0]}; {required}")
    check_mesh(mesh, where)
    ends = [np.array([each.points.min(axis=0), each.points.max(axis=0)]) for each in (mesh, own)]
    if (apart := np.abs(ends[0] - ends[1]).max()) > APART * own.extent:
        raise SceneError(f"{where} ends {apart:.3g} m from the scene's: check its unit of length")
    matrix = interpolation(mesh, own.points)
    masses = matrix.T @ scene.masses
    if not masses.min() > 0.0:
        fault = f"no vertex of the scene's mesh is near its vertex {int(masses.argmin())}"
        raise SceneError(f"{where}: {fault}; use a mesh with larger elements everywhere")
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

    The list is empty if the mesh was not generated; grids that are not coarser are left out.
    """
    config = scene.config.mesh
    if not isinstance(config, GeneratedMesh):
        return []
    made = {mesh.vertices: mesh for mesh in (config.with_cells(part) for part in parts)}
    coarser = sorted(size for size in made if size < scene.mesh.vertices)
    return [on_mesh(scene, made[size]) for size in reversed(coarser)]


def spacing(mesh: Mesh) -> float:
    """Return the mean spacing of the vertices, up to a factor that depends only on the body."""
    solid = len(mesh.tetrahedra)
    return float(solid ** (-1 / 3) if solid else len(mesh.triangles) ** (-1 / 2))


def mesh_error(spacings: Sequence[float], runs: Sequence[np.ndarray]) -> float | None:
    """Estimate the relative error due to the finest of three meshes (Richardson extrapolation).

    If a mesh of spacing h has the error C h^p, the differences of three runs determine C and p.
    The result is None if the order p is outside `ORDERS`, or nothing moves.

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
    """Estimate the relative error due to the mesh of ``run``; None if unknown, see `mesh_error`.

    run : (F + 1, N, 3) m, converged, on the scene's mesh; None if it does not converge
    coarser, runs : coarser meshes, and converged runs on them at the scene's vertices; only the
        first and the last are used
    """
    found = [run, *(runs[i] for i in (0, -1) if len(runs) > 1)]
    known = [each for each in found if each is not None]
    if len(known) < 3:
        return None
    meshes = [coarser[0].fine, coarser[0].scene.mesh, coarser[-1].scene.mesh]
    return mesh_error([spacing(mesh) for mesh in meshes], known)


def interpolation(mesh: Mesh, points: np.ndarray) -> sparse.csr_array:
    """Return the matrix (P, N) that interpolates values at the vertices of ``mesh`` linearly.

    The weights of each of the ``points`` (P, 3) m are barycentric coordinates of the nearest point
    of the mesh at rest: non-negative weights with sum one on the vertices of one element.
    """
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    corners = mesh.points[cells]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    chosen, weights = np.zeros(len(points), np.int64), np.empty((len(points), cells.shape[1]))
    distance, least = np.full(len(points), np.inf), np.empty(len(points))
    inside = INSIDE * mesh.extent
    # search elements of similar sizes together: one large element would widen every search
    sizes = np.floor(np.log2(radii))
    for own in (np.flatnonzero(sizes == size) for size in np.unique(sizes)):
        tree, count, radius = cKDTree(centres[own]), min(FIRST, len(own)), radii[own].max()
        left = np.flatnonzero(distance > inside)
        while len(left):
            for part in np.array_split(left, -(-len(left) * count // PAIRS)):
                far, near = tree.query(points[part], k=np.arange(1, count + 1))
                found, apart = _nearest(corners[own[near]], points[part])
                best, rows = apart.argmin(axis=1), np.arange(len(part))
                nearer = apart[rows, best] < distance[part]
                rows, best, closer = rows[nearer], best[nearer], part[nearer]
                chosen[closer], weights[closer] = own[near[rows, best]], found[rows, best]
                distance[closer] = apart[rows, best]
                # lower bound for elements not tried: distance of the centre minus radius
                least[part] = far[:, -1] - radius
            more = count < len(own)
            left = left[distance[left] > np.maximum(least[left], inside)] if more else left[:0]
            count = min(4 * count, len(own))
    starts = cells.shape[1] * np.arange(len(points) + 1)
    shape = (len(points), mesh.vertices)
    return sparse.csr_array((weights.ravel(), cells[chosen].ravel(), starts), shape=shape)


def _nearest(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return barycentric coordinates (P, c, m) of nearest points in elements, distances (P, c) m.

    corners : (P, c, m, 3) m, of c elements for each of the ``points`` (P, 3) m
    """
    size = corners.shape[2]
    weights = np.zeros(corners.shape[:3])
    distance = np.full(corners.shape[:2], np.inf)
    # the nearest point lies inside the element, in a side or an edge, or is a corner
    for part in (p for n in range(size, 0, -1) for p in combinations(range(size), n)):
        first, others = corners[:, :, part[0]], corners[:, :, part[1:]]
        edges = others - first[:, :, None]
        gram = edges @ edges.swapaxes(2, 3)
        seen = edges @ (points[:, None] - first)[..., None]
        shares = np.linalg.solve(gram, seen)[..., 0] if len(part) > 1 else seen[..., 0]
        own = np.concatenate([1.0 - shares.sum(axis=-1, keepdims=True), shares], axis=-1)
        at = np.einsum("pcm,pcmd->pcd", own, corners[:, :, part])
        apart = np.linalg.norm(at - points[:, None], axis=-1)
        nearer = (own >= -INSIDE).all(axis=-1) & (apart < distance)
        shares = np.zeros_like(weights)
        shares[..., list(part)] = np.maximum(own, 0.0)
        weights[nearer], distance[nearer] = shares[nearer], apart[nearer]
    return weights / weights.sum(axis=-1, keepdims=True), distance
