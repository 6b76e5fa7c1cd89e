"""The order in which a local step visits its elements.

A kernel projects a block of elements in lanes, and a block takes the expensive path as soon as one
of its elements needs it. Neighbours are in like states, so that blocks of neighbours are cheap
where little happens; their vertices are also in the cache still. Meshers list elements in the order
in which they were made, neighbours far apart. What a group shows to others (S, weights,
projections) keeps the order of the mesh; only the arrays of its kernels do not.
"""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.model.constraints.lanes import LANES

# The order of the mesh is kept if its blocks have at most so many times the vertices that others
# would have. Grids keep theirs.
KEPT = 1.5


def visiting_order(stencil: np.ndarray, vertices: int) -> np.ndarray | None:
    """Elements (e,) in the order to visit them; None for the order that they have.

    They are sorted by their vertices, numbered by the reverse Cuthill-McKee algorithm (Cuthill and
    McKee 1969), which gives neighbours numbers close to each other.

    Parameters
    ----------
    stencil : (e, m) vertices of each element
    vertices : number of all vertices
    """
    if len(stencil) == 0:
        return None
    rank = np.empty(vertices, dtype=np.int64)
    rank[csgraph.reverse_cuthill_mckee(_neighbours(stencil, vertices), True)] = np.arange(vertices)
    order = np.lexsort(np.sort(rank[stencil], axis=1).T[::-1])
    return order if _corners(stencil) > KEPT * _corners(stencil[order]) else None


def _neighbours(stencil: np.ndarray, vertices: int) -> sparse.csr_array:
    """Graph (N, N) of the vertices that have an element in common."""
    e, m = stencil.shape
    rows = np.repeat(np.arange(e), m)
    incidence = sparse.csr_array((np.ones(e * m), (rows, stencil.ravel())), shape=(e, vertices))
    return sparse.csr_array(incidence.T @ incidence)


def _corners(stencil: np.ndarray) -> int:
    """Number of vertices of the blocks, added up."""
    blocks = np.arange(len(stencil)) // LANES
    pairs = blocks[:, None] * (int(stencil.max()) + 1) + stencil
    return len(np.unique(pairs))
