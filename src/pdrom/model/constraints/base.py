"""The constraint group: operator S, weights W and projection p.

Energy of a group (Bouaziz et al. 2014, eq. 4): W(q) = 1/2 sum_e w_e || S_e q - p_e(q) ||_F^2.
"""

from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field
from scipy import sparse

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.local_kernel import LocalKernel, LocalPass, projections
from pdrom.model.effects.base import Effect, EffectConfig
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh

# Kinds of cells that elements lie on, with a function: mesh -> vertices of all such cells.
CELLS: dict[str, Callable[[Mesh], np.ndarray]] = {
    "vertex": lambda mesh: np.arange(mesh.vertices)[:, None],
    "edge": lambda mesh: mesh.edges(),
    "triangle": lambda mesh: mesh.triangles,
    "tetrahedron": lambda mesh: mesh.tetrahedra,
}
Weight = Annotated[float, Field(gt=0.0, le=1e16, allow_inf_nan=False)]


class WeightFactor(ConfigModel):
    """Factor on the weight of the elements inside a selection (with all their vertices)."""

    select: Selection
    factor: Weight


class GroupConfig(EffectConfig):
    """``weight`` w of the group; the element weights are w times the rest measure where stated.

    ``factors`` change the weight of some elements, one after the other.
    """

    weight: Weight
    factors: tuple[WeightFactor, ...] = ()


class ConstraintGroup(Effect):
    """A set of equal constraints, evaluated in batches.

    Attributes
    ----------
    name : name of the group in configuration and tables
    elements : number e of elements
    rows_per_element : rows p of each element's operator
    S : (e p, N) CSR, the unweighted differential operator
    weights : (e,) element weights, rest measure included
    """

    rows_per_element: int
    split_from: int
    """Elements from which the group has two parts (`pdrom.model.constraints.parts`); a group that
    always is one part does not set it."""
    S: sparse.csr_array
    weights: np.ndarray
    gradient_kernel: Any = None
    """Compiled projection from S q (module `gradient_kernel`), if there is one."""
    local_kernel: LocalKernel | None = None
    """Compiled `accumulate`, for loops in compiled code; a group without one writes its own."""
    _pass: LocalPass | None = None
    manifold: ClassVar[str | None] = None
    """Set that it projects on, if it is one of "clamped" (signed singular values in a range, which
    are the `kernel_parameters`), "length" or "half sphere": kernels are then compared with its
    projection in high precision; or "size" (a volume or an area in a range), without a bound."""
    frame_lagged: bool = False
    """Whether ``begin_frame`` freezes anything."""
    cells: ClassVar[str]
    """Place of an element: a key of `CELLS`."""
    unit: ClassVar[str] = ""
    """Unit of a projection; empty where it has none."""

    @classmethod
    def element_vertices(cls, mesh: Mesh) -> np.ndarray:
        """Vertices (e, m) of each element on a mesh, in the order of the elements."""
        return CELLS[cls.cells](mesh)

    def element_weights(self, mesh: Mesh) -> float | np.ndarray:
        """Weight of each element of ``mesh`` without its rest measure, (e,), or one number for all.

        Raises
        ------
        SceneError
            A selection that holds no element of the group.
        """
        if not self.config.factors:
            return self.config.weight
        vertices = self.element_vertices(mesh)
        weights = np.full(len(vertices), self.config.weight)
        for number, entry in enumerate(self.config.factors):
            inside = np.isin(vertices, select_vertices(mesh, entry.select)).all(axis=1)
            if not inside.any():
                raise SceneError(
                    f"factors[{number}]: selects no element, which lies on a {self.cells}"
                )
            weights[inside] *= entry.factor
        return weights

    @property
    def elements(self) -> int:
        """Number e of elements."""
        return len(self.weights)

    @property
    def row_weights(self) -> np.ndarray:
        """Diagonal of W, (e p,)."""
        return np.repeat(self.weights, self.rows_per_element)

    def begin_frame(self, q: np.ndarray, elements: np.ndarray | None = None) -> None:
        """Freeze what depends on first positions ``q`` (N, 3) m, for ``elements`` (m,) or all."""

    def kernel_parameters(self) -> np.ndarray:
        """Numbers that ``gradient_kernel`` needs in addition to S q, in the order that it expects.

        Frame-lagged ones are those of the last ``begin_frame``.
        """
        raise NotImplementedError(f"{self.name} has no gradient kernel")

    def project(self, y: np.ndarray) -> np.ndarray:
        """Projections p(y) of all elements at ``y`` (N, 3) m, (e p, 3)."""
        return self.project_elements(y, np.arange(self.elements))

    def sampler(self, elements: np.ndarray) -> LocalKernel:
        """Local kernel that writes the projections of some elements (int64), flat, in their order.

        It is called with the place of the projections in place of that of the right-hand side.
        """
        raise NotImplementedError(f"{self.name} has no sampler")

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """Projections of ``elements`` at ``y`` (N, 3) m, (len(elements) p, 3), in their order."""
        elements = np.ascontiguousarray(elements, dtype=np.int64)
        return projections(self.sampler(elements), y, self.rows_per_element * len(elements))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) in place; return the energy, J."""
        if self.local_kernel is None:
            raise NotImplementedError(f"{self.name} has neither a local kernel nor its own")
        if self._pass is None or self._pass.kernels != (self.local_kernel,):
            self._pass = LocalPass([self.local_kernel])
        return self._pass.accumulate(y, rhs)

    @abstractmethod
    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """NumPy reference: ``d`` = S_e q -> p_e, both (m, p, 3), of ``elements`` (m,)."""

    @abstractmethod
    def restricted(
        self, elements: np.ndarray, factors: np.ndarray
    ) -> tuple["ConstraintGroup", np.ndarray]:
        """The group of some elements only, on the vertices they need.

        Parameters
        ----------
        elements : (m,) element indices
        factors : (m,) what each element weight is multiplied by

        Returns
        -------
        group, vertices
            A group whose positions are those of ``vertices`` (n,), in this order.
        """

    def system_matrix(self) -> sparse.csr_array:
        """S^T W S, (N, N) CSR."""
        return (self.S.T @ self.S.multiply(self.row_weights[:, None])).tocsr()

    def roundoff(self, q: np.ndarray) -> float:
        """Round-off in S q of ``q`` (N, 3) m: eps times the norm of the cancelling |S| |q|."""
        return float(np.finfo(float).eps * np.linalg.norm(abs(self.S) @ np.abs(q)))


class StencilGroup(ConstraintGroup):
    """A group whose elements all have the same number m of vertices.

    Attributes
    ----------
    stencil : (e, m) int32 vertex indices
    operator : (e, p, m) dense element operators: S_e q = operator[e] @ q[stencil[e]]
    """

    stencil: np.ndarray
    operator: np.ndarray
    per_element: tuple[str, ...] = ()
    """Names of further arrays with one entry per element."""

    def restricted(
        self, elements: np.ndarray, factors: np.ndarray
    ) -> tuple[ConstraintGroup, np.ndarray]:
        vertices, local = np.unique(self.stencil[elements], return_inverse=True)
        part = copy(self)
        part.stencil = local.reshape(len(elements), self.stencil.shape[1]).astype(np.int32)
        part.weights = self.weights[elements] * factors
        for name in ("operator", *self.per_element):
            setattr(part, name, np.ascontiguousarray(getattr(self, name)[elements]))
        part._assemble(len(vertices))
        return part, vertices

    def _assemble(self, vertices: int) -> None:
        e, p, m = self.operator.shape
        rows = np.repeat(np.arange(e * p), m)
        columns = np.repeat(self.stencil[:, None, :], p, axis=1).ravel()
        self.S = sparse.csr_array((self.operator.ravel(), (rows, columns)), shape=(e * p, vertices))


def require_cells(mesh: Mesh, kind: str, effect: str) -> np.ndarray:
    """The mesh's cells of ``kind``, which ``effect`` needs; SceneError if there are none."""
    cells = getattr(mesh, kind)
    if kind == "triangles" and len(mesh.tetrahedra):
        raise SceneError(f"effect '{effect}' needs a surface mesh, this mesh is a volume")
    if len(cells) == 0:
        raise SceneError(f"effect '{effect}' needs {kind}, this mesh has none")
    return np.ascontiguousarray(cells, dtype=np.int32)


def directions(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors and lengths (..., 1) of vectors ``a`` (..., 3); zero where one is zero."""
    # scaled: neither overflow nor underflow of the squares
    largest = np.abs(a).max(axis=-1, keepdims=True)
    part = a / np.where(largest > 0.0, largest, 1.0)
    length = np.linalg.norm(part, axis=-1, keepdims=True)
    return part / np.where(length > 0.0, length, 1.0), largest * length
