"""Derivatives dp/dd of projections, with eigenvalues above 1 replaced by 1, for Newton's method.

The Hessian w (I - dp/dd) of an element's energy 1/2 w |d - p|^2 is then positive semi-definite.

Let F = d^T have the singular values sigma_i and vectors u_i, v_i, and p the values t_i. dp/dd has
the eigenvectors (u_i v_j^T -+ u_j v_i^T) / sqrt(2) with eigenvalues (t_i +- t_j) / (sigma_i +-
sigma_j); on the matrices u_i v_i^T it is J = dt/dsigma: 1 or 0 for values clamped to a range, 0 for
lengths and directions. For a product in a range (module `products`) t_i (t_i - sigma_i) = m for all
i, and J = diag(t_i n_i) - n n^T / sum_i n_i / t_i with n_i = t_i / (t_i^2 + m). If m < 0, J has one
eigenvalue 0 and others above 1, so that clamping gives J of m = 0.
"""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.constraints import lanes, simplex, svd3
from pdrom.model.constraints.lanes import LANES, load, load_matrix

KINDS = {"length": 1, "half sphere": 1, "clamped": 2, "size": 3}
"""Number of the formula for a `ConstraintGroup.manifold`; others have none."""
PAIRS = 6  # pairs of axes (a, b) with a <= b: 00, 01, 02, 11, 12, 22
ALIKE = 1e-7  # relative difference up to which two singular values count as equal


@compiled(nogil=True)
def derivatives(kind, rows, d, p, allowed, weights, m, out):
    """Write w dp/dd of m elements to ``out``: for each of `PAIRS` of axes a matrix (rows, rows).

    Elements have ``rows`` vectors: S q ``d``, projections ``p`` and ``weights`` w of each vector.
    ``kind`` is from `KINDS`, ``allowed`` the range of singular values or of their product.
    """
    work, size, t = np.zeros(svd3.SIZE * LANES), 3 * rows, np.zeros(3)
    slopes, basis, images = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    for start in range(0, m, LANES):
        simplex.copy_rows(d, rows, start, work, simplex.F)
        svd3.factor_block(work)
        for lane in range(min(LANES, m - start)):
            u, v = load_matrix(work, svd3.B, lane), load_matrix(work, svd3.V, lane)
            t[:], e = 0.0, start + lane
            for k in range(size):
                for a in range(size):
                    basis[k, a] = u[k // rows][a // rows] * v[k % rows][a % rows]
                    if k % (rows + 1) == 0:
                        t[k // rows] += basis[k, a] * p[3 * (rows * e + a % rows) + a // rows]
            _slopes(kind, rows, load(work, svd3.SIGMA, lane), t, allowed, slopes)
            for k in range(size):
                for a in range(size):
                    images[k, a] = 0.0
                    for j in range(size):
                        images[k, a] += slopes[k, j] * basis[j, a]
            place = PAIRS * rows * rows * e
            for a in range(3):
                for b in range(a, 3):
                    for r in range(a * rows, (a + 1) * rows):
                        for s in range(b * rows, (b + 1) * rows):
                            total = 0.0
                            for k in range(size):
                                total += images[k, r] * basis[k, s]
                            out[place] = weights[rows * e] * total
                            place += 1


@lanes.lane_function
def _slopes(kind, rows, sigma, t, allowed, slopes):
    """Write dp/dd, clamped, in the basis u_i v_j^T, which has the number i rows + j."""
    product = sigma[0] * sigma[1] * (sigma[2] if rows == 3 else 1.0)
    sized = kind == 3 and not allowed[0] < product < allowed[1]
    m, total = max(t[0] * (t[0] - sigma[0]), 0.0) if sized else 0.0, 0.0
    for j in range(rows):
        total += 1.0 / (t[j] * t[j] + m)
    for i in range(rows):
        for j in range(rows):
            n = t[i] / (t[i] * t[i] + m) * t[j] / (t[j] * t[j] + m)
            slopes[i * rows + i, j * rows + j] = -n / total if sized else 0.0
        if kind == 3 or (kind == 2 and allowed[0] < sigma[i] < allowed[1]):
            slopes[i * rows + i, i * rows + i] += t[i] * t[i] / (t[i] * t[i] + m)
    for i in range(1, 3):
        for j in range(min(i, rows)):
            k, a, b = j * (rows + 1), i * rows + j, j * rows + i
            same = slopes[k, k] - (slopes[k, i * (rows + 1)] if i < rows else 0.0)
            both, ends = sigma[j] + sigma[i], t[j] + t[i]
            if sigma[j] - sigma[i] > ALIKE * both:
                same = min((t[j] - t[i]) / (sigma[j] - sigma[i]), 1.0)
            turned = ends / both if 0.0 <= ends < both else 1.0
            slopes[a, a] = 0.5 * (same + turned)
            if i < rows:
                slopes[b, b], slopes[a, b] = slopes[a, a], 0.5 * (same - turned)
                slopes[b, a] = slopes[a, b]
