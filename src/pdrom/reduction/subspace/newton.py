"""Newton's method for a frame in a position subspace: Hessian, Cholesky factor, L-BFGS.

It minimises the objective of local-global iterations (free coordinates y, prediction s, d = S q):

    E(y) = 1/2 (y - s)^T (M/h^2) (y - s) + sum_i w_i/2 |d_i - p_i(d)|^2,    d = D y + d_0

A step solves H x = grad E and halves x until E has decreased. If this fails, a local-global
iteration, which never raises E, replaces the step. H is first the system matrix, then this minus
D^T (w dp/dd) D (module `derivatives`, as slow as ten to thirty steps), renewed after `FIRST` steps,
`RENEW` others or a failure. L-BFGS updates H (Nocedal 1980). Vectors are sorted by axis.
"""

from typing import Any

import numpy as np

from pdrom.model.compiled.arithmetic import add_scaled, subtract
from pdrom.model.compiled.arithmetic import constant as filled
from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, at, copied, load, store
from pdrom.model.compiled.rows import write as copy
from pdrom.model.constraints.derivatives import KINDS, PAIRS, derivatives
from pdrom.model.dynamics.acceleration import SHORTEST, SUFFICIENT
from pdrom.reduction.subspace.products import blocks, objective, product, project, vectors

AXES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # in the order of `PAIRS`
TALL, WIDE, CHUNK = 4, 8, 32  # entries summed in registers; elements whose rows fit in the cache
RENEW, FIRST = 32, 16
# A frame has converged at a step (root mean square) of CONVERGED times the extent, or the distance
# that UNNOTICED, m/s^2, moves in a frame if that is less; relative rounding error of an objective.
CONVERGED, UNNOTICED, ROUNDOFF = 1e-6, 1e-2, 8.0 * np.finfo(float).eps


def newton_arrays(sampled: Any, space: Any, system: Any, enough: float) -> tuple[Any, ...]:
    """Make arrays of `run_newton` for an elimination; frames end at the slope ``enough``, J."""
    free, strain = system.free, sampled.strain[:, system.free]
    own, groups = np.ix_(free, free), sampled.groups
    (m, size), k = strain.shape, -(-len(free) // WIDE) * WIDE
    columns, padded = np.zeros((m, k)), np.eye(k)
    columns[:, :size], padded[:size, :size] = strain, space.matrix[own]
    diagonal, inertia = np.kron(np.eye(3), padded), blocks(space.inertia_matrix[own])
    kinds = np.array([KINDS.get(group.manifold, 0) for group in groups])
    rows = np.array([group.rows_per_element for group in groups])
    pull = blocks((sampled.row_weights[:, None] * strain).T)
    memory = vectors(max(m, size)), vectors(m), *(vectors(size) for _ in range(3))
    hessian = kinds, rows, copied(columns.ravel()), copied(diagonal.ravel()), 3 * k
    return hessian, pull, inertia, memory, enough, np.linalg.cholesky(diagonal)


@inner
def _subtract_products(a, i, b, j, k, rows, out, to):
    """Subtract A^T B, a tile, from ``out`` at the place and row length ``to``; A, B: rows of k."""
    place, width = to
    s0 = t0 = s1 = t1 = s2 = t2 = s3 = t3 = filled(0.0)
    for r in range(0, rows * k, k):
        v, w = load(b, j + r), load(b, j + r + WIDTH)
        s0, t0 = add_scaled(s0, at(a, i + r), v), add_scaled(t0, at(a, i + r), w)
        s1, t1 = add_scaled(s1, at(a, i + r + 1), v), add_scaled(t1, at(a, i + r + 1), w)
        s2, t2 = add_scaled(s2, at(a, i + r + 2), v), add_scaled(t2, at(a, i + r + 2), w)
        s3, t3 = add_scaled(s3, at(a, i + r + 3), v), add_scaled(t3, at(a, i + r + 3), w)
    for s, t in ((s0, t0), (s1, t1), (s2, t2), (s3, t3)):
        store(out, place, subtract(load(out, place), s))
        store(out, place + WIDTH, subtract(load(out, place + WIDTH), t))
        place += width


@compiled(nogil=True)
def factored_hessian(hessian, weights, sampled):
    """Return the lower Cholesky factor of the Hessian at the S q and p in ``sampled``."""
    kinds, rows, columns, system, width = hessian
    _, elements, starts, parameters, parameter_starts, d, p = sampled
    k, factor = width // 3, system.copy()
    for g in range(len(kinds)):
        n, first, images = rows[g], starts[g], np.empty(rows[g] * CHUNK * k)
        m = elements[g] if kinds[g] else 0
        part, allowed = slice(3 * first, 3 * starts[g + 1]), parameters[parameter_starts[g] :]
        slopes = np.empty(PAIRS * n * n * m)
        derivatives(kinds[g], n, d[part], p[part], allowed, weights[first:], m, slopes)
        for block in range(0, PAIRS * m, PAIRS * CHUNK):
            start, count = (first + n * block // PAIRS) * k, min(CHUNK, m - block // PAIRS)
            for pair, (a, b) in enumerate(AXES):
                for row in range(n * count):
                    entry = (block + PAIRS * (row // n) + pair) * n * n + row % n
                    for i in range(0, k, WIDTH):
                        total = filled(0.0)
                        for s in range(n):
                            own = load(columns, start + (row // n * n + s) * k + i)
                            total = add_scaled(total, at(slopes, entry + n * s), own)
                        store(images, row * k + i, total)
                for i in range(0, k, TALL):
                    for j in range(0, i + TALL if a == b else k, WIDE):
                        to = ((b * k + i) * width + a * k + j, width)
                        _subtract_products(columns, start + i, images, j, k, n * count, factor, to)
    lower = factor.reshape(width, width)
    for i in range(width):
        for j in range(i + 1):
            left = lower[i, j] - dot(lower[i, :j], lower[j, :j])
            lower[i, j] = left / lower[j, j] if j < i else np.sqrt(left)
    return lower


@compiled(nogil=True)
def run_newton(count, size, rows, operators, sampled, newton):
    """Do up to ``count`` steps in place of `run_iterations`; end if none lowers the objective."""
    strain, lift, offset, constant, z, weights, mass, start = operators
    hessian, pull, inertia, (nothing, apart, moved, pushed, forces), enough, factor = newton
    d, p, y, before, n = sampled[5], sampled[6], z[: 3 * size], np.empty(3 * size), hessian[4]
    gradient, x, pairs = np.zeros(n), np.zeros(n), np.zeros((2 * RENEW, n))
    copy(y, start)
    project(strain, rows, size, offset, z, sampled)
    value, length = objective(weights, d, p, mass, y, start), 0.0
    known, failed = 0, False
    for step in range(count):
        apart[: 3 * rows] = d[: 3 * rows] - p[: 3 * rows]
        moved[: 3 * size] = y - start
        product(inertia, size, size, nothing, moved, pushed)
        product(pull, size, rows, pushed, apart, forces)
        if step == FIRST:
            moved[: 3 * size] = start  # at s, elements are stretched; later many have no stiffness
            project(strain, rows, size, offset, moved, sampled)
        if step == FIRST or known == RENEW or failed:
            known, factor = 0, factored_hessian(hessian, weights, sampled)
        for i in range(n):
            now = forces[i % (n // 3) * 3 + i // (n // 3)] if i % (n // 3) < size else 0.0
            if known:
                pairs[2 * known - 2, i], pairs[2 * known - 1, i] = -length * x[i], now - gradient[i]
            gradient[i] = now
        _direct(pairs, known, factor, gradient, x)
        slope, noise = -dot(gradient, x), ROUNDOFF * value
        if not slope < -(max(noise, enough) if step else noise):
            return
        copy(y, before)
        length, reached = 2.0, np.inf
        while length > SHORTEST and not reached <= value + SUFFICIENT * length * slope + noise:
            length *= 0.5
            for i in range(3 * size):
                y[i] = before[i] - length * x[i % 3 * (n // 3) + i // 3]
            project(strain, rows, size, offset, z, sampled)
            reached = objective(weights, d, p, mass, y, start)
        known, failed = known + 1, not reached <= value + noise
        if failed:
            copy(before, y)
            project(strain, rows, size, offset, z, sampled)
            product(lift, size, rows, constant, p, z)
            project(strain, rows, size, offset, z, sampled)
            reached = objective(weights, d, p, mass, y, start)
        value = reached


@inner
def _direct(pairs, known, factor, gradient, x):
    """Set x = H^-1 gradient; ``pairs``: ``known`` steps, each followed by the gradient's change."""
    copy(gradient, x)
    shares, curvatures = np.zeros(known), np.zeros(known)
    for j in range(known - 1, -1, -1):
        curvatures[j] = dot(pairs[2 * j], pairs[2 * j + 1])
        shares[j] = dot(pairs[2 * j], x) / curvatures[j] if curvatures[j] > 0.0 else 0.0
        x -= shares[j] * pairs[2 * j + 1]
    for i in range(len(x)):
        x[i] = (x[i] - dot(factor[i, :i], x[:i])) / factor[i, i]
    for i in range(len(x) - 1, -1, -1):
        x[i] /= factor[i, i]
        for j in range(i):
            x[j] -= factor[i, j] * x[i]
    for j in range(known):
        share = dot(pairs[2 * j + 1], x) / curvatures[j] if curvatures[j] > 0.0 else 0.0
        x += (shares[j] - share) * pairs[2 * j]
