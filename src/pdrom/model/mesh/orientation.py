"""Triangles of a surface turned the same way as their neighbours."""

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.core.errors import MeshError


def turned_alike(triangles: np.ndarray, name: str) -> np.ndarray:
    """Mark the triangles (T,) bool to turn over so that neighbours see a side from the same side.

    In each connected part the fewer ones are turned. Two copies of every triangle, as it is and
    turned over, are joined with those of a neighbour that agree with them: a part of the surface
    has two sides if this graph falls into two.

    Raises
    ------
    MeshError
        A part has one side only, as Möbius' strip; ``name`` opens the message.
    """
    t = len(triangles)
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    order = np.lexsort(np.sort(edges, axis=1).T)
    ends = np.sort(edges, axis=1)[order]
    second = 1 + np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    a, b = order[second - 1] // 3, order[second] // 3
    # neighbours that are turned alike run through their edge in opposite directions
    opposite = edges[order[second - 1], 0] == edges[order[second], 0]
    pairs = np.concatenate(
        [np.column_stack([a, b + t * opposite]), np.column_stack([a + t, b + t * ~opposite])]
    )
    graph = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(2 * t, 2 * t))
    labels = csgraph.connected_components(graph, directed=False)[1].reshape(2, t)
    if (labels[0] == labels[1]).any():
        first = np.flatnonzero(labels[0] == labels[1])[0]
        raise MeshError(
            f"{name}: the surface about triangle {first} {triangles[first].tolist()} has one side "
            "only, so that its triangles cannot be turned the same way"
        )
    part, side = np.min(labels, axis=0), labels[0] > labels[1]
    turned = np.bincount(part, side, minlength=2 * t)
    return side ^ (2.0 * turned > np.bincount(part, minlength=2 * t))[part]
