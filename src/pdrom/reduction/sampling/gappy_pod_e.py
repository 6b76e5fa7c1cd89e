"""GappyPOD+E: more samples than modes, each selected to raise sigma_min(P^T V) the most.

B. Peherstorfer, Z. Drmac, S. Gugercin, Stability of discrete empirical interpolation and gappy
proper orthogonal decomposition with randomized and deterministic sampling points, SIAM J. Sci.
Comput. 42 (2020), section 4. Points are generalised to blocks of rows (elements).
"""

import numpy as np
from scipy import linalg

from pdrom.core.errors import SamplingError

# Bound on rounding errors of B B^T, relative to its trace; B: rows of the basis for one element.
ROUNDOFF = 1e-11


def oversample(
    v: np.ndarray, size: int, elements: np.ndarray, count: int = 0, bound: float = np.inf
) -> np.ndarray:
    """Extend ``elements`` to ``count`` or more, until the DEIM constant is at most ``bound``.

    The DEIM constant || (P^T V)^+ ||_2 is the factor by which the elements' rows P^T V of the basis
    V can amplify errors. It is 1 for all elements and orthonormal columns, so that every bound of
    at least 1 can be satisfied. Return all elements if even these do not suffice.
    SamplingError if an element is repeated or out of range.

    v : (size e, r) basis, ``size`` consecutive rows for each of the e elements
    elements : distinct elements that are already selected, usually one for each mode
    """
    growing = _Growing(v, size, elements)
    while len(growing.picked) < growing.total:
        if len(growing.picked) >= count and growing.gain <= bound:
            break
        growing.add()
    return np.array(growing.picked, dtype=np.int64)


class _Growing:
    """Sampled elements and the Gram matrix G = (P^T V)^T P^T V of their rows P^T V of a basis V.

    picked : sampled elements in order of selection
    total : number of all elements
    """

    def __init__(self, v: np.ndarray, size: int, elements: np.ndarray) -> None:
        self._rows = np.ascontiguousarray(v)
        self._blocks = self._rows.reshape(-1, size, v.shape[1])
        # products B B^T (10 % of the memory of the rows B), for the bounds in `_growth_at_most`
        self._squares = self._blocks @ self._blocks.transpose(0, 2, 1)
        self._sizes = np.trace(self._squares, axis1=1, axis2=2)
        self.picked, self.total = [int(e) for e in elements], len(self._blocks)
        if len({e for e in self.picked if 0 <= e < self.total}) < len(self.picked):
            fault = f"different elements from 0 to {self.total - 1} are required"
            raise SamplingError(f"elements {self.picked[:5]} to start with: {fault}")
        rows = self._blocks[self.picked].reshape(-1, v.shape[1])
        self._gram = rows.T @ rows
        self._decompose()

    @property
    def gain(self) -> float:
        """DEIM constant 1 / sigma_min(P^T V); inf if P^T V lacks full column rank."""
        roundoff = len(self._gram) * np.finfo(float).eps * np.trace(self._gram)
        return 1.0 / np.sqrt(self._smallest) if self._smallest > roundoff else np.inf

    def add(self) -> None:
        """Add the element that most raises a lower bound of the Gram matrix's least eigenvalue."""
        self.picked.append(self._strongest())
        block = self._blocks[self.picked[-1]]
        self._gram += block.T @ block
        self._decompose()

    def _decompose(self) -> None:
        """Compute G's least eigenvalue, its eigenvector and gap to the next (inf for one mode)."""
        last = min(1, len(self._gram) - 1)
        values, vectors = linalg.eigh(
            self._gram, subset_by_index=(0, last), check_finite=False, driver="evr"
        )
        self._smallest, self._weakest = float(values[0]), vectors[:, 0]
        self._gap = max(float(values[1] - values[0]), 0.0) if last else np.inf

    def _strongest(self) -> int:
        """Return the unsampled element with the largest `eigenvalue_growth`.

        Two upper bounds exclude most elements, so that their growth is not computed: |B u|^2, with
        the rows B of an element and the eigenvector u of the smallest eigenvalue, compared with the
        growth of the element where it is largest; then `_growth_at_most` in the same way. If no
        other element grows more than the first of these two elements, the first is returned.
        """
        products = (self._rows @ self._weakest).reshape(self.total, -1)
        strength = np.einsum("es,es->e", products, products)
        strength[self.picked] = -1.0
        first = int(np.argmax(strength))
        bound = self._growth(np.array([first]), products)[0]
        if bound == 0.0:
            return first
        others = np.flatnonzero(strength > bound)
        if len(others):
            most = self._growth_at_most(others, products)
            best = self._growth(others[[np.argmax(most)]], products)[0]
            others = others[most >= best]
        growth = self._growth(others, products)
        return int(others[np.argmax(growth)]) if growth.max(initial=0.0) > bound else first

    def _growth_at_most(self, elements: np.ndarray, products: np.ndarray) -> np.ndarray:
        """Upper bounds on `eigenvalue_growth` by ``elements``, from B B^T of the rows B of each."""
        products = products[elements]
        squared = np.einsum("es,es->e", products, products)
        stretched = np.einsum("est,et->es", self._squares[elements], products)
        beside = np.einsum("es,es->e", stretched, products) / squared - squared
        least = np.maximum(beside - ROUNDOFF * self._sizes[elements], 0.0)
        return (1.0 + ROUNDOFF) * _smaller_root(squared, least, self._gap)

    def _growth(self, elements: np.ndarray, products: np.ndarray) -> np.ndarray:
        blocks, products = self._blocks[elements], products[elements]
        return eigenvalue_growth(blocks, products, self._weakest, gap=self._gap)


def eigenvalue_growth(
    blocks: np.ndarray, products: np.ndarray, weakest: np.ndarray, gap: float
) -> np.ndarray:
    """Bound from below how much B^T B raises the least eigenvalue of a symmetric matrix, (m,).

    For u the eigenvector of the smallest eigenvalue, g the gap to the next one and b = B u,

        t = 2 g |b|^2 / (g + n + sqrt((g - n)^2 + 4 g c)),   c = |C^T b|^2 / |b|^2,   n = |b|^2 + c,

    with C = B - b u^T, the part of B orthogonal to u. t is the smaller root of
    t^2 - (g + n) t + g |b|^2 without cancellation, accurate to all digits also near a double root
    (g = n, c = 0), where the usual form loses half of them.

    For a single row n = |B|^2 and t is the bound of Ipsen and Nadler (2009), eq. (4.3) in
    Peherstorfer et al. (2020). For several rows: if all other eigenvalues are lowered to the second
    smallest, the growth is the root of t = sum_i beta_i^2 f(mu_i), f(mu) = (g - t) / (g - t + mu),
    where mu_i are the eigenvalues of C C^T and beta_i the components of b in its eigenvectors. As f
    is convex, Jensen's inequality gives a lower bound with the mean c of the mu_i, weighted by
    beta_i^2. An infinite gap gives t = |b|^2.

    blocks : (m, s, r) matrices B of m elements that may be added
    products : (m, s) vectors b = B u of these elements
    weakest : (r,) the unit vector u
    gap : g >= 0
    """
    squared = np.einsum("es,es->e", products, products)
    pulled = (products[:, None, :] @ blocks)[:, 0] - squared[:, None] * weakest
    beside = np.einsum("ek,ek->e", pulled, pulled)
    beside = np.divide(beside, squared, out=np.zeros_like(beside), where=squared > 0.0)
    return _smaller_root(squared, beside, gap)


def _smaller_root(squared: np.ndarray, beside: np.ndarray, gap: float) -> np.ndarray:
    """Return t (m,) of `eigenvalue_growth` for |b|^2 = ``squared``, c = ``beside``, g = ``gap``."""
    if np.isinf(gap):
        return squared
    mean = squared + beside
    denominator = gap + mean + np.sqrt((gap - mean) ** 2 + 4.0 * gap * beside)
    growth = np.zeros_like(squared)
    return np.divide(2.0 * gap * squared, denominator, out=growth, where=denominator > 0.0)
