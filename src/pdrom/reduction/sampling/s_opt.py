"""S-OPT: samples that maximise the S-measure of the sampled basis, one after the other.

J. T. Lauzon, S. W. Cheung, Y. Shin, Y. Choi, D. M. Copeland, K. Huynh, S-OPT: A points selection
algorithm for hyper-reduction in reduced order models, SIAM J. Sci. Comput. 46 (2024), after Shin
and Xiu (2016). Points are generalised to blocks of rows (the elements). The S-measure, see
`s_opt_path`, is 1 if the sampled columns are orthogonal and 0 if they are dependent.
"""

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from pdrom.core.errors import SamplingError
from pdrom.reduction.sampling.deim import GrowingFit, Selection

# A unit column counts as dependent on others if its part orthogonal to them has a norm below this.
# For a copy of a column, rounding errors give up to 1e-15 sqrt(r).
DEPENDENT = 1e-12


def s_opt_path(v: np.ndarray, size: int) -> np.ndarray:
    """Select elements for which S(A) = (sqrt(det A^T A) / prod_j |A_j|)^(1/r) is largest, greedily.

    Return min(e, r) indices, the first k for k modes. In step k, A is the first k modes at k
    elements. In the first step S is 1 for every element; this step selects the element with the
    largest norm of the first mode, as classical DEIM does.

    ``v`` (size e, r) has ``size`` consecutive rows for each of the e elements; size 1 is the method
    of the paper. SamplingError if a mode depends on the earlier modes at the sampled rows,
    whichever element is added to them.
    """
    state = _Sampled(v, size)
    for mode in range(min(v.shape[1], state.total)):
        state.add(state.best(mode), mode)
    return np.array(state.picked, dtype=np.int64)


class SOpt(Selection):
    """S-OPT: one element for each mode in turn by the S-measure; `extend` adds more elements."""

    def one_a_mode(self, v: np.ndarray, size: int, ranks: Sequence[int]) -> dict[int, np.ndarray]:
        path = s_opt_path(v, size)
        return {r: path[:r] for r in ranks}

    def extend(self, v: np.ndarray, size: int, chosen: np.ndarray, count: int) -> np.ndarray:
        """Extend ``chosen`` to ``count`` elements, each maximising the S-measure of all modes.

        SamplingError if the modes are linearly dependent at the ``chosen`` elements.
        """
        count = min(count, len(v) // size)
        if count <= len(chosen):
            return np.asarray(chosen, dtype=np.int64)
        state = _Sampled(v, size, chosen)
        while len(state.picked) < count:
            state.add(state.best())
        return np.array(state.picked, dtype=np.int64)


class _Sampled:
    """Sampled elements, with data from which the S-measure with one more element is computed.

    G is the Gram matrix (k, k) of the sampled rows of k modes, B (s, k) the s rows of one of the e
    elements: det(G + B^T B) = det G det(I + M), M = B G^-1 B^T. After an element with rows D is
    sampled, M of each element becomes M - X (I + D G^-1 D^T)^-1 X^T, X = B G^-1 D^T (Woodbury). A
    new mode is fitted by the k modes at the sampled rows: z (s,) is the residual at the rows B, q
    the squared norm of the residual at the sampled rows. It multiplies det(G + B^T B) by
    q + z^T (I + M)^-1 z, and M becomes M + z z^T / q.

    picked : sampled elements in order of selection
    """

    def __init__(self, v: np.ndarray, size: int, elements: Sequence[int] | np.ndarray = ()) -> None:
        # the S-measure does not depend on the length of columns; unit length reduces errors
        norms = np.linalg.norm(v, axis=0)
        if not norms.all():
            raise SamplingError(f"S-OPT: mode {int(np.argmin(norms)) + 1} is zero")
        self._blocks = (v / norms).reshape(-1, size, v.shape[1])
        self.total = len(self._blocks)
        self._squares = np.einsum("esk,esk->ek", self._blocks, self._blocks)
        self.picked = [int(e) for e in elements]
        self._products = np.zeros((self.total, size, size))
        self._modes, self._fit = 0, GrowingFit(v.shape[1])
        if self.picked:
            self._fit.add(self._blocks[self.picked].reshape(-1, v.shape[1]))
            self._modes = v.shape[1]
            self._products = self._blocks @ self._inverse() @ self._blocks.transpose(0, 2, 1)

    def best(self, mode: int | None = None) -> int:
        """Return the element with which the sampled rows of all modes so far, and of ``mode``, have
        the largest S-measure; SamplingError if the modes are dependent whichever is added."""
        if not self.picked and mode is not None:
            return int(np.argmax(self._squares[:, mode]))
        shifted = self._products + np.eye(self._products.shape[1])  # I + M (M: see `_Sampled`)
        modes, residual = self._modes, np.ones(self.total)
        if mode is not None:
            z, q = self._residual()
            solved = np.linalg.solve(shifted, z[:, :, None])[:, :, 0]
            modes, residual = mode + 1, q + np.maximum(np.einsum("es,es->e", z, solved), 0.0)
        possible = residual > DEPENDENT**2
        # M = B G^-1 B^T (see the class) is semidefinite: log det(I + M) < 0 is a rounding error
        determinants = np.maximum(np.linalg.slogdet(shifted)[1], 0.0)
        columns = self._squares[self.picked, :modes].sum(axis=0) + self._squares[:, :modes]
        measure = np.full(self.total, -np.inf)
        measure[possible] = np.log(residual[possible])
        measure[possible] += determinants[possible] - np.log(columns[possible]).sum(axis=1)
        measure[self.picked] = -np.inf
        if np.isneginf(measure).all():
            raise SamplingError("S-OPT: no element makes the sampled modes independent")
        return int(np.argmax(measure))

    def add(self, element: int, mode: int | None = None) -> None:
        """Add ``element`` to the samples and ``mode``, if given, to the modes of the S-measure."""
        inverse, columns = self._inverse(), self._blocks[:, :, : self._modes]
        rows = columns[element]
        small = np.eye(len(rows)) + rows @ inverse @ rows.T
        cross = columns @ (inverse @ rows.T)
        solved = np.linalg.solve(small, cross.reshape(-1, len(rows)).T).T.reshape(cross.shape)
        self._products -= cross @ solved.transpose(0, 2, 1)
        self.picked.append(element)
        self._fit.add(self._blocks[element])
        if mode is not None:
            z, q = self._residual()
            if q <= DEPENDENT**2:
                raise SamplingError(
                    f"S-OPT: mode {mode + 1} depends on the modes before it at all elements"
                )
            self._products += z[:, :, None] * z[:, None, :] / q
            self._modes = mode + 1

    def _residual(self) -> tuple[np.ndarray, float]:
        """Return z (e, s) of all elements and q for the next mode; see the class for z and q."""
        known, new = self._blocks[:, :, : self._modes], self._blocks[:, :, self._modes]
        z = new - known @ self._fit.coefficients(self._modes)
        return z, float(np.sum(z[self.picked] ** 2))

    def _inverse(self) -> np.ndarray:
        """Inverse (k, k) of the Gram matrix G of the sampled rows."""
        factor = self._fit.triangle(self._modes)
        diagonal, rows = np.abs(np.diag(factor)), len(self.picked) * self._blocks.shape[1]
        if rows < self._modes or diagonal.min(initial=1.0) <= DEPENDENT * diagonal.max(initial=0.0):
            raise SamplingError(
                f"S-OPT: the first {self._modes} modes depend on each other at the "
                f"{len(self.picked)} sampled elements"
            )
        half = linalg.solve_triangular(factor, np.eye(self._modes), check_finite=False)
        return half @ half.T
