"""Potential energy of all groups and its gradient, in compiled code.

W(y) = sum_j 1/2 sum_e w_e |S_e y - p_e(y)|^2 has the gradient S^T W S y - S^T W p(y), because p is
the nearest point: what moves p moves along the manifold (Bouaziz et al. 2014, sect. 3).
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from pdrom.model.compiled.arithmetic import add_scaled, constant
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, load, store
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import LocalPass, Table, add_part

# Arguments of `add_projections`, and of `multiply`.
Tables = tuple[Table, ...]
Matrix = tuple[np.ndarray, np.ndarray, np.ndarray]


class Potential:
    """Compiled local steps of groups, and the matrix S^T W S of all of them.

    Attributes
    ----------
    tables : first argument of `add_projections`
    stiffness : S^T W S, first argument of `multiply`
    """

    def __init__(self, groups: Sequence[ConstraintGroup], vertices: int) -> None:
        kernels = [group.local_kernel for group in groups if group.local_kernel is not None]
        self._pass = LocalPass(kernels)  # keeps the arrays that the tables point to
        local = self._pass
        self.tables: Tables = local.first, local.preparing, local.second
        total = sparse.csr_array((vertices, vertices))
        for group in groups:
            total = total + group.system_matrix()
        self.stiffness = rows_of(total)


def rows_of(matrix: sparse.csr_array) -> Matrix:
    """A matrix (N, N) as `multiply` takes it."""
    ordered = sparse.csr_array(matrix)
    ordered.sort_indices()
    return ordered.indptr.astype(np.int32), ordered.indices.astype(np.int32), ordered.data


@compiled(nogil=True)
def add_projections(tables, y, rhs):
    """Add S^T W p(y) of all groups in ``tables`` to ``rhs``, both padded, flat; the energy W(y)."""
    kernels, preparing, second = tables
    y_place, rhs_place = y.ctypes.data, rhs.ctypes.data
    add_part(preparing, y_place, rhs_place)
    energy = add_part(kernels, y_place, rhs_place)
    return energy + add_part(second, y_place, rhs_place)


@compiled(nogil=True)
def multiply(matrix, y, out):
    """Overwrite ``out`` by the matrix times ``y``, both padded vectors, flat."""
    indptr, indices, data = matrix
    for i in range(len(indptr) - 1):
        total = constant(0.0)
        for k in range(at(indptr, i), at(indptr, i + 1)):
            total = add_scaled(total, at(data, k), load(y, WIDTH * at(indices, k)))
        store(out, WIDTH * i, total)
