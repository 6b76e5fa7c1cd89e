"""Operators and energies against finite differences."""

import numpy as np
import pytest

from builders import make_scene

STEP = 1e-6


def central(function, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Central difference of ``function`` at ``point`` along ``direction``."""
    return (function(point + STEP * direction) - function(point - STEP * direction)) / (2 * STEP)


def test_energy_gradient_is_the_elastic_force(group_scene, rng):
    """dW/dq = S^T W (S q - p): the projection is the nearest point of a fixed manifold.

    The derivative of p does not enter (envelope theorem); for bending the manifold is fixed by the
    normals of the frame's beginning.
    """
    group, points = group_scene.groups[0], group_scene.mesh.points
    y = points + 0.02 * rng.standard_normal(points.shape)
    group.begin_frame(points)

    def energy(q: np.ndarray) -> float:
        return group.accumulate(q, np.zeros_like(q))

    force = group.S.T @ (group.row_weights[:, None] * (group.S @ y - group.project(y)))
    for _ in range(5):
        direction = rng.standard_normal(points.shape)
        expected = float(np.sum(force * direction))
        assert central(energy, y, direction) == pytest.approx(expected, rel=2e-4)


def test_bending_operator_is_the_gradient_of_area(rng):
    """A_v H_v = d(total area)/dq_v at rest (Pinkall and Polthier 1993)."""
    mesh = {"kind": "cloth", "rows": 7, "columns": 6, "wave": 0.1}
    scene = make_scene({"effect": "bending", "weight": 1.0}, mesh=mesh)
    group, points, triangles = scene.groups[0], scene.mesh.points, scene.mesh.triangles

    def area(q: np.ndarray) -> float:
        a, b, c = (q[triangles[:, i]] for i in range(3))
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    curvature = group.S @ points
    for element in rng.permutation(group.elements)[:5]:
        for axis in range(3):
            direction = np.zeros_like(points)
            direction[group.vertices[element], axis] = 1.0
            expected = curvature[element, axis] * group.weights[element]
            assert central(area, points, direction) == pytest.approx(expected, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize(
    ("group", "mesh", "edges"),
    [
        ("strain", {"kind": "cloth", "rows": 4, "columns": 4}, 2),
        ("deformation_gradient", {"kind": "bar", "nx": 3, "ny": 3, "nz": 3}, 3),
    ],
)
def test_deformation_gradient_is_the_derivative_of_a_smooth_map(group, mesh, edges, rng):
    """For a smooth map F_e approaches its Jacobian as the map is observed on a smaller scale."""
    scene = make_scene({"effect": group, "weight": 1.0}, mesh=mesh)
    operator, points = scene.groups[0], scene.mesh.points
    quadratic = 0.3 * rng.standard_normal((3, 3, 3))

    def deform(x: np.ndarray) -> np.ndarray:
        return x + np.einsum("abc,nb,nc->na", quadratic, x, x)

    errors = []
    for scale in (1e-2, 1e-3):
        small = scale * (points - points.mean(axis=0))
        f = (operator.S @ deform(small)).reshape(operator.elements, edges, 3) / scale
        centre = small[operator.stencil].mean(axis=1)
        jacobian = np.eye(3) + 2.0 * np.einsum(
            "abc,nc->nab", 0.5 * (quadratic + quadratic.transpose(0, 2, 1)), centre
        )
        corner = (points[operator.stencil][:, 1:] - points[operator.stencil][:, :1]).transpose(
            0, 2, 1
        )
        # F maps the rest edges in the element's frame (D, with D^-T inside S) as the Jacobian does
        seen = np.einsum("eka,ebk->eab", f, np.linalg.inv(operator.operator[:, :, 1:]))
        errors.append(np.abs(seen - jacobian @ corner).max())
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 1e-2


def test_global_step_minimises_the_objective(group_scene, rng):
    """The solution of the global step is stationary: no direction lowers the quadratic."""
    scene = group_scene
    system = scene.system_with("supernodal")
    points = scene.mesh.points
    s = points + 0.05 * rng.standard_normal(points.shape)
    p = [group.project(s) for group in scene.groups]
    rhs = system.inertia[:, None] * s
    for group, projection in zip(scene.groups, p, strict=True):
        rhs += group.S.T @ (group.row_weights[:, None] * projection)
    y = np.empty_like(points)
    system.eliminate(np.empty(0, dtype=np.int64)).solve(rhs, y)

    def objective(q: np.ndarray) -> float:
        total = 0.5 * float(system.inertia @ ((q - s) ** 2).sum(axis=1))
        for group, projection in zip(scene.groups, p, strict=True):
            residual = group.S @ q - projection
            total += 0.5 * float(group.row_weights @ (residual**2).sum(axis=1))
        return total

    scale = objective(y)
    for _ in range(5):
        direction = rng.standard_normal(points.shape)
        assert abs(central(objective, y, direction)) < 1e-5 * scale
        assert objective(y + 1e-3 * direction) > scale
