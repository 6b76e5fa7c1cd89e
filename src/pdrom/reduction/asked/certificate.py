"""Bound of what a frame misses, from its residual, where the objective of the frame is convex.

The implicit step looks for a stationary point of g(y) = 1/2 |y - s|_D^2 + sum_e w_e psi_e(S_e y),
D = M / h^2. Its Hessian is D + S^T W (I - J) S with the derivatives J of the projections, which
`ceilings` bounds by U_e for all y with |y - y_0|_D <= R. Where P = D + S^T W (I - U) S >= nu D,
nu > 0, and |grad g(y_0)|_{P^-1} < R sqrt(nu), exactly one stationary point is as near, and at most
|grad g(y_0)|_{P^-1} / sqrt(nu) away in the norm of D. At R = 0, P > 0 says that the contraction
number of a local/global iteration, the largest eigenvalue of A^-1 S^T W J S, is below one.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene

WIDENED = 1.5  # R over the distance that follows from the derivatives at y_0 alone
SURE = 1e-2  # eigenvalues are computed to this part, and relied on without it
# Lipschitz numbers of the derivative of d / |d|, times |d|^2, and of that of the nearest rotation,
# times the square of the sum of the two smaller singular values.
DIRECTION, ROTATION = 2.0 / np.sqrt(3.0), 4.0 + 4.0 * np.sqrt(2.0)


class ImplicitStep:
    """Objective of ``frame`` of ``scene`` from the state ``before`` it."""

    def __init__(self, scene: Scene, before: State, frame: int) -> None:
        space = scene.space(scene.system)
        self._scene, self._before, self._inertia = scene, before.positions, scene.system.inertia
        self._s = space.predict(before.positions, before.velocities, scene.config.time_step)
        fixed, self._s[fixed] = space.fixed(frame, before.positions)
        self._free = np.setdiff1d(np.arange(len(self._s)), fixed)

    def gradient(self, y: np.ndarray) -> np.ndarray:
        """Gradient of g at ``y`` (N, 3) m by the n free vertices, (n, 3) N."""
        total = self._inertia[:, None] * (y - self._s)
        for group in self._scene.groups:
            group.begin_frame(self._before)
            total += group.S.T @ (group.row_weights[:, None] * (group.S @ y - group.project(y)))
        return total[self._free]

    def residual(self, y: np.ndarray) -> float:
        """Norm of the gradient at ``y`` (N, 3) m in D^-1, J^1/2."""
        return float(np.linalg.norm(self.gradient(y) / np.sqrt(self._inertia[self._free, None])))

    def certify(self, y: np.ndarray) -> tuple[float, float]:
        """Bound the distance of ``y`` (N, 3) m to a converged end, if that is possible.

        Returns
        -------
        The eigenvalue of the Hessian at ``y`` relative to D that is nearest to zero, negative if
        any of them is, nan where projections are not smooth; and the bound, m, nan if there is none
        (or an obstacle may be met: contacts are no part of g).
        """
        gradient = self.gradient(y).ravel()
        least, near = self._least(y, gradient, 0.0)
        _, distance = self._least(y, gradient, WIDENED * near) if near < np.inf else (0.0, np.inf)
        bound = distance / float(np.sqrt(self._inertia.min()))
        clear = all(contact.gaps(y).min() > bound for contact in self._scene.contacts)
        return least, bound if clear and distance <= WIDENED * near < np.inf else np.nan

    def _least(self, y: np.ndarray, gradient: np.ndarray, radius: float) -> tuple[float, float]:
        """Least eigenvalue for all states as near, and the norm of the gradient in P^-1 / nu."""
        inertia = np.repeat(self._inertia, 3)
        mobility = np.zeros(len(y))
        mobility[self._free] = 1.0 / self._inertia[self._free]
        total = sparse.csr_array(sparse.diags_array(inertia))
        for group in self._scene.groups:
            shape = (group.elements, group.rows_per_element)
            reach = np.sqrt((group.S.power(2) @ mobility).reshape(shape).sum(axis=1))
            ceiling = ceilings(group, (group.S @ y).reshape(*shape, 3), radius * reach)
            if ceiling is None:
                return np.nan, np.inf
            blocks = group.weights[:, None, None] * (np.eye(3 * shape[1]) - ceiling)
            e = np.arange(group.elements + 1)
            wide = sparse.kron(group.S, sparse.eye_array(3), format="csr")
            total = total + wide.T @ (sparse.bsr_array((blocks, e[:-1], e)) @ wide)
        free = (3 * self._free[:, None] + np.arange(3)).ravel()
        matrix = sparse.csc_array(sparse.csc_array(total)[:, free][free])
        # pivots on the diagonal have the signs of the eigenvalues (Sylvester)
        options = {"SymmetricMode": True}
        factor = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        positive = np.array_equal(factor.perm_r, factor.perm_c) and factor.U.diagonal().min() > 0.0
        (nearest,) = eigsh(
            matrix, 1, sparse.csc_array(sparse.diags_array(inertia[free])), 0.0, tol=SURE,
            OPinv=LinearOperator(matrix.shape, matvec=factor.solve, dtype=float),
            v0=np.random.default_rng(0).standard_normal(len(free)), return_eigenvectors=False,
        )  # fmt: skip
        if not positive:
            return -abs(float(nearest)), np.inf
        nu = (1.0 - SURE) * float(nearest)
        return float(nearest), float(np.sqrt(gradient @ factor.solve(gradient) / nu))


def ceilings(group: ConstraintGroup, strain: np.ndarray, radii: np.ndarray) -> np.ndarray | None:
    """Upper bounds U_e (e, 3p, 3p) of the derivatives of ``group``'s projections near a state.

    They hold, as quadratic forms, where each S_e y is at most ``radii`` (e,) from its ``strain``
    (e, p, 3). Directions and rotations turn smoothly away from collapse; singular values clamped to
    a range do not, and get the largest slope there is. None where an element may be collapsed or
    inverted, and for other manifolds.
    """
    if group.manifold not in ("length", "clamped"):
        return None
    size = 3 * group.rows_per_element
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = _directions if group.manifold == "length" else _clamped
        least, own, rise = slopes(group, strain, radii)
    return own + rise[:, None, None] * np.eye(size) if (least > 0.0).all() else None


def _directions(
    group: ConstraintGroup, strain: np.ndarray, radii: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least lengths |d|, derivatives of L d / |d|, and by how much these may rise."""
    length = np.linalg.norm(strain, axis=2)
    rest = np.linalg.norm(group.reference_project(strain, np.arange(len(strain))), axis=2)
    unit, least = strain[:, 0] / length, length[:, 0] - radii
    own = (rest / length)[:, :, None] * (np.eye(3) - unit[:, :, None] * unit[:, None, :])
    return least, own, DIRECTION * rest[:, 0] * radii / (length[:, 0] * least)


def _clamped(
    group: ConstraintGroup, strain: np.ndarray, radii: np.ndarray
) -> tuple[np.ndarray, np.ndarray | float, np.ndarray]:
    """Least singular values s, derivatives of the nearest rotations, and how far these may rise.

    For a range: nothing, and the largest slope. Slopes are at most 1, (p_i + p_j) / (s_i + s_j) and
    p_i / s_i, with p clamped from s > 0, hence at most max(1, low / s).
    """
    u, s, v = np.linalg.svd(strain, full_matrices=False)
    low, high = group.kernel_parameters()
    solid = group.rows_per_element == 3
    least = s[:, -1] * (np.sign(np.linalg.det(strain)) if solid else 1.0) - radii
    if not solid or low < high:
        return least, 0.0, np.maximum(1.0, low / least)
    own = np.zeros((len(s), 9, 9))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        turn = u[:, :, i, None] * v[:, j, None, :] - u[:, :, j, None] * v[:, i, None, :]
        turn = turn.reshape(-1, 9)
        own += turn[:, :, None] * turn[:, None, :] / (s[:, i] + s[:, j])[:, None, None]
    pair = s[:, 1] + s[:, 2]
    return least, own, ROTATION * radii / (pair * (pair - 2.0 * radii))
