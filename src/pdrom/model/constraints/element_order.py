"""The order in which a local step visits its elements, so that vertices are still in the cache.

Meshers list elements in the order in which they were made, neighbours far apart. What a group shows
to others (S, weights, projections) keeps the order of the mesh; only its kernel's own arrays do not.
"""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

# Fewer elements have their vertices in the cache anyhow.
FROM = 10_000
# Elements whose vertices are in the innermost cache together.
WINDOW = 512
# The order of the mesh is kept if it loads at most so many times the vertices that the other does.
# It is what grids have, whose results shall not depend on what is here.
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
    if len(stencil) < FROM:
        return None
    rank = np.empty(vertices, dtype=np.int64)
    rank[csgraph.reverse_cuthill_mckee(_neighbours(stencil, vertices), True)] = np.arange(vertices)
    order = np.lexsort(np.sort(rank[stencil], axis=1).T[::-1])
    return order if _loads(stencil) > KEPT * _loads(stencil[order]) else None


def _neighbours(stencil: np.ndarray, vertices: int) -> sparse.csr_array:
    """Graph (N, N) of the vertices that have an element in common."""
    e, m = stencil.shape
    rows = np.repeat(np.arange(e), m)
    incidence = sparse.csr_array((np.ones(e * m), (rows, stencil.ravel())), shape=(e, vertices))
    return sparse.csr_array(incidence.T @ incidence)


def _loads(stencil: np.ndarray) -> int:
    """How often a vertex is loaded if each window of elements begins with an empty cache."""
    windows = np.array_split(stencil, -(-len(stencil) // WINDOW))
    return sum(len(np.unique(window)) for window in windows)
