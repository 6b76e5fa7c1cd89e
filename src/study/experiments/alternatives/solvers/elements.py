"""Elements of all groups one after the other, for methods that go from element to element.

Each has a distance to the matrices with clamped singular values: with D = S_e q =
sum_i sigma_i v_i u_i^T (p x 3) the projection is P = sum_i f_i v_i u_i^T, f_i the clamped sigma_i,
and 1/2 |D - P|^2 has the gradient D - P. Eigenvectors of its Hessian are v_i u_i^T (stretch),
(v_i u_j^T +- v_j u_i^T) / sqrt 2 (shear and twist) and v_i n^T with n at right angles to all u
(turn of the plane). Their eigenvalues have a closed form (as in Smith et al. 2019 for other
energies); negative ones are raised. Springs are the case p = 1 with a range of one length.
"""

from dataclasses import dataclass, fields

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.base import StencilGroup
from pdrom.model.constraints.lanes import cross, dot, lane_function, perpendicular, scaled
from pdrom.model.constraints.spring import EdgeSpring
from pdrom.model.scene import Scene

KINDS = ("length", "clamped")  # manifolds whose residual and Hessian are known in closed form
SWEEPS = 12  # of Jacobi rotations, at most; three rows need four or five
SMALL = 1e-14  # a row this much shorter than the longest has no direction of its own
MODES = 9


@dataclass(frozen=True)
class Elements:
    """e elements; one with p rows has p + 1 corners.

    rows : (e,) p
    corners : (e, 4) vertices, filled up with zeros
    operator : (e, 3, 4), of each the first p rows and p + 1 columns
    weights, low, high : (e,) weight, and range of the singular values
    fallback : (e, 3) direction of an element that has shrunk to a point
    """

    rows: np.ndarray
    corners: np.ndarray
    operator: np.ndarray
    weights: np.ndarray
    low: np.ndarray
    high: np.ndarray
    fallback: np.ndarray

    @classmethod
    def of(cls, scene: Scene, method: str) -> "Elements":
        """All elements of a scene; SceneError if a group is none that ``method`` takes."""
        parts = []
        for group in scene.groups:
            if group.manifold not in KINDS or not isinstance(group, StencilGroup):
                raise SceneError(
                    f"scene '{scene.config.name}', effect '{group.name}': method '{method}' takes "
                    "springs, triangle strain and tetrahedra only"
                )
            parts.append(_arrays(group))
        return cls(
            *(np.ascontiguousarray(np.concatenate(part)) for part in zip(*parts, strict=True))
        )

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """Arrays for compiled code: rows, corners, operator, weights, low, high, fallback."""
        return tuple(getattr(self, each.name) for each in fields(self))

    def by_colour(self) -> "Elements":
        """The elements in an order in which neighbours in the list share no vertex.

        Elements of one colour share none; the first colour that is free at all corners is taken.
        The processor then overlaps the work on several of them.
        """
        colours = _colours(self.rows, self.corners, int(self.corners.max(initial=0)) + 1)
        order = np.argsort(colours, kind="stable")
        return Elements(*(np.ascontiguousarray(array[order]) for array in self.arrays))

    def around(self, vertices: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Elements at each of ``vertices`` N: starts (N + 1,), elements, and which corner it is."""
        used = np.arange(4) <= self.rows[:, None]
        element, corner = np.nonzero(used)
        vertex = self.corners[used]
        order = np.argsort(vertex, kind="stable")
        starts = np.searchsorted(vertex[order], np.arange(vertices + 1))
        return starts, element[order], corner[order]


def _arrays(group: StencilGroup) -> tuple[np.ndarray, ...]:
    e, p, m = group.operator.shape
    corners = np.zeros((e, 4), np.int64)
    corners[:, :m] = group.stencil
    operator = np.zeros((e, 3, 4))
    operator[:, :p, :m] = group.operator
    fallback = np.tile([1.0, 0.0, 0.0], (e, 1))
    if isinstance(group, EdgeSpring):
        fallback = group.rest
        low = high = np.linalg.norm(fallback, axis=1)
    else:
        low, high = (np.full(e, bound) for bound in group.kernel_parameters())
    return np.full(e, p, np.int64), corners, operator, group.weights, low, high, fallback


@compiled
def _colours(rows, corners, vertices):
    """Colours (e,) of elements; the last of 63 is for those that no other colour is left for."""
    taken = np.zeros(vertices, np.int64)
    colours = np.empty(len(rows), np.int64)
    for e in range(len(rows)):
        used = 0
        for corner in range(rows[e] + 1):
            used |= taken[corners[e, corner]]
        colour = 0
        while colour < 62 and (used >> colour) & 1:
            colour += 1
        for corner in range(rows[e] + 1):
            taken[corners[e, corner]] |= 1 << colour
        colours[e] = colour
    return colours


def workspace() -> tuple[np.ndarray, ...]:
    """Arrays that `decompose_element` works with: D, u, v, sigma."""
    return np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)


@lane_function
def decompose_element(y, e, p, corners, operator, fallback, d, u, v, sigma):
    """Decompose S_e y, see `study.experiments.alternatives.solvers.elements.decompose`.

    Arrays are passed one by one: taking them from a tuple for each element costs more than the
    decomposition, because compiled code counts who holds them.

    Parameters
    ----------
    y : padded positions, flat, m
    e, p : number of the element and of its rows
    corners, operator, fallback : of all elements, see `Elements`
    d, u, v, sigma : of `workspace`, written
    """
    d[:] = 0.0
    for corner in range(p + 1):
        place = WIDTH * corners[e, corner]
        for row in range(p):
            for k in range(3):
                d[row, k] += operator[e, row, corner] * y[place + k]
    decompose(d, p, (fallback[e, 0], fallback[e, 1], fallback[e, 2]), u, v, sigma)


@lane_function
def _row(a, i):
    return (a[i, 0], a[i, 1], a[i, 2])


@lane_function
def _set_row(a, i, vector):
    a[i, 0], a[i, 1], a[i, 2] = vector


@lane_function
def _unit(a):
    return scaled(1.0 / np.sqrt(dot(a, a)), a)


@lane_function
def _rotate(d, v, p, i, j):
    """Make the rows i and j of d orthogonal; whether they were not."""
    a, b = _row(d, i), _row(d, j)
    alpha, beta, gamma = dot(a, a), dot(b, b), dot(a, b)
    if not abs(gamma) > 1e-16 * np.sqrt(alpha * beta):
        return False
    zeta = (beta - alpha) / (2.0 * gamma)
    t = np.copysign(1.0, zeta) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = c * t
    for k in range(3):
        d[i, k], d[j, k] = c * d[i, k] - s * d[j, k], s * d[i, k] + c * d[j, k]
    for k in range(p):
        v[k, i], v[k, j] = c * v[k, i] - s * v[k, j], s * v[k, i] + c * v[k, j]
    return True


@lane_function
def _swap(d, v, p, i, j):
    """Exchange two rows, one of them with the other sign: v stays a rotation."""
    for k in range(3):
        d[i, k], d[j, k] = d[j, k], -d[i, k]
    for k in range(p):
        v[k, i], v[k, j] = v[k, j], -v[k, i]


@lane_function
def decompose(d, p, fallback, u, v, sigma):
    """D = sum_i sigma_i v_i u_i^T of the first p rows of ``d``, which is overwritten.

    Parameters
    ----------
    fallback : direction of u_0 where D is zero
    u : (3, 3) receives right-handed orthonormal rows, those from p on at right angles to D
    v : (3, 3) receives the columns v_i, a rotation
    sigma : (3,) receives singular values, largest first; for p = 3 the last carries the sign of
        the determinant
    """
    largest = 0.0
    for i in range(p):
        for k in range(3):
            largest = max(largest, abs(d[i, k]))
    v[:] = 0.0
    for i in range(p):
        v[i, i] = 1.0
        for k in range(3):
            d[i, k] /= largest if largest > 0.0 else 1.0
    for _ in range(SWEEPS):
        rotated = False
        for i in range(p):
            for j in range(i + 1, p):
                rotated = _rotate(d, v, p, i, j) or rotated
        if not rotated or p == 2:
            break
    for i in range(p):
        for j in range(i + 1, p):
            if dot(_row(d, j), _row(d, j)) > dot(_row(d, i), _row(d, i)):
                _swap(d, v, p, i, j)
    first = _row(d, 0) if largest > 0.0 else fallback
    _set_row(u, 0, _unit(first))
    a = _row(u, 0)
    b = perpendicular(a)
    if p > 1:
        own = _row(d, 1)
        part = dot(own, a)
        rest = (own[0] - part * a[0], own[1] - part * a[1], own[2] - part * a[2])
        if dot(rest, rest) > SMALL**2:
            b = _unit(rest)
    _set_row(u, 1, b)
    _set_row(u, 2, cross(a, b))
    for i in range(p):
        sigma[i] = largest * dot(_row(d, i), _row(u, i))


@lane_function
def clamped(x, low, high):
    """x within [low, high]."""
    return min(max(x, low), high)


@lane_function
def residual(u, v, sigma, p, low, high, r):
    """Write D - P to the first p rows of ``r`` (3, 3); |D - P|^2.

    Parameters
    ----------
    u, v, sigma : see `decompose`
    low, high : range that singular values are clamped to
    """
    square = 0.0
    r[:p] = 0.0
    for i in range(p):
        beyond = sigma[i] - clamped(sigma[i], low, high)
        square += beyond * beyond
        if beyond != 0.0:
            for row in range(p):
                for k in range(3):
                    r[row, k] += beyond * v[row, i] * u[i, k]
    return square


@lane_function
def _mode(values, modes, count, floor, value, v, u, p, i, j, sign):
    """Append (v_i u_j^T + sign v_j u_i^T), normalised, if its eigenvalue is positive."""
    if not value > floor:
        value = floor
    if value == 0.0:
        return count
    factor = 1.0 if sign == 0.0 else np.sqrt(0.5)
    for row in range(p):
        for k in range(3):
            entry = v[row, i] * u[j, k]
            if sign != 0.0:
                entry += sign * v[row, j] * u[i, k]
            modes[count, row, k] = factor * entry
    values[count] = value
    return count + 1


@lane_function
def hessian(u, v, sigma, p, low, high, floor, values, modes):
    """Eigenvalues and eigenvectors of the Hessian of 1/2 |D - P|^2; how many are written.

    Parameters
    ----------
    u, v, sigma : see `decompose`
    low, high : range that singular values are clamped to
    floor : in [0, 1]; smaller eigenvalues are raised to it, those that stay zero left out. All are
        at most 1, so that a floor of 1 gives the identity: the Hessian of projective dynamics.
    values : (MODES,)
    modes : (MODES, 3, 3), of each the first p rows
    """
    count = 0
    for i in range(p):
        f = clamped(sigma[i], low, high)
        inside = low < sigma[i] < high
        count = _mode(values, modes, count, floor, 0.0 if inside else 1.0, v, u, p, i, i, 0.0)
        for j in range(i + 1, p):
            g = clamped(sigma[j], low, high)
            gap, total = sigma[i] - sigma[j], sigma[i] + sigma[j]
            shear = (0.0 if inside else 1.0) if gap <= 0.0 else 1.0 - (f - g) / gap
            twist = 1.0 - (f + g) / total if total > 0.0 else 0.0
            count = _mode(values, modes, count, floor, shear, v, u, p, i, j, 1.0)
            count = _mode(values, modes, count, floor, twist, v, u, p, i, j, -1.0)
        for n in range(p, 3):
            across = 1.0 - f / sigma[i] if sigma[i] > 0.0 else 0.0
            count = _mode(values, modes, count, floor, across, v, u, p, i, n, 0.0)
    return count
