"""Base classes of constraint groups, with operator S, weights w_e (matrix W) and projection p.

Energy of a group (Bouaziz et al. 2014, eq. 4): 1/2 sum_e w_e || S_e q - p_e(q) ||_F^2.
"""

from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field
from scipy import sparse

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.local_kernel import LocalKernel
from pdrom.model.effects.base import Effect, EffectConfig
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh

# Kind of mesh cell that can carry a constraint -> function: vertex indices (c, m) of all c cells.
CELLS: dict[str, Callable[[Mesh], np.ndarray]] = {
    "vertex": lambda mesh: np.arange(mesh.vertices)[:, None],
    "edge": lambda mesh: mesh.edges(),
    "triangle": lambda mesh: mesh.triangles,
    "tetrahedron": lambda mesh: mesh.tetrahedra,
}
Weight = Annotated[float, Field(gt=0.0, le=1e16, allow_inf_nan=False)]


class WeightFactor(ConfigModel):
    """A ``factor`` multiplies the weights of the elements whose vertices are all in ``select``."""

    select: Selection
    factor: Weight


class GroupConfig(EffectConfig):
    """``weight`` w of a constraint; some groups multiply it by the element's rest area or volume.

    Each of ``factors`` multiplies the weights of the elements that it selects.
    """

    weight: Weight
    factors: tuple[WeightFactor, ...] = ()


class ConstraintGroup(Effect):
    """A set of constraints of one kind, one per mesh element, which are evaluated together.

    name : name of the group in configuration and tables
    elements : number e of elements
    rows_per_element : number p of rows of each element's operator
    S : (e p, N) CSR, the unweighted differential operator on N vertices
    weights : (e,) weights of the elements; some groups multiply them by rest area or volume
    """

    rows_per_element: int
    S: sparse.csr_array
    weights: np.ndarray
    gradient_kernel: Any = None
    """Compiled function that maps S q to projections (`local_kernel.gradient_kernel`), or None."""
    local_kernel: LocalKernel | None = None
    """Compiled form of `accumulate` for compiled loops, in a group from `for_run`, else None."""
    _of_run = False
    manifold: ClassVar[str | None] = None
    """Set onto which elements are projected: "clamped" (signed singular values in the range
    `kernel_parameters`), "length" (of an edge), "half sphere", or "size" (unbounded set with a
    volume or area in a range). Tests compare the first three with high-precision projections."""
    frame_lagged: bool = False
    """Whether the projection uses data that ``begin_frame`` computes once per frame."""
    cells: ClassVar[str]
    """Kind of mesh cell on which each element lies, a key of `CELLS`."""
    unit: ClassVar[str] = ""
    """Physical unit of the projections; empty if they are dimensionless."""

    @classmethod
    def element_vertices(cls, mesh: Mesh) -> np.ndarray:
        """Return the vertex indices (e, m) of the e elements that the group has on ``mesh``."""
        return CELLS[cls.cells](mesh)

    def element_weights(self, mesh: Mesh) -> float | np.ndarray:
        """Return weights not yet multiplied by rest area or volume: (e,), or one for all elements.

        Raises SceneError if a selection of ``factors`` contains no element of the group.
        """
        if not self.config.factors:
            return self.config.weight
        vertices = self.element_vertices(mesh)
        weights = np.full(len(vertices), self.config.weight)
        for number, entry in enumerate(self.config.factors):
            inside = np.isin(vertices, select_vertices(mesh, entry.select)).all(axis=1)
            if not inside.any():
                raise SceneError(
                    f"factors[{number}]: no element ({self.cells}) has all vertices in select"
                )
            weights[inside] *= entry.factor
        return weights

    @property
    def elements(self) -> int:
        """Number e of elements."""
        return len(self.weights)

    @property
    def row_weights(self) -> np.ndarray:
        """Diagonal (e p,) of the weight matrix W: the element weight of each row."""
        return np.repeat(self.weights, self.rows_per_element)

    def begin_frame(self, q: np.ndarray, elements: np.ndarray | None = None) -> None:
        """Compute data that are fixed during a frame, such as normals, at ``q`` (N, 3) m for
        ``elements`` (m,); None: all. Only groups from `for_run` store such data."""

    def _require_frame(self) -> None:
        if self.frame_lagged and not self._of_run:
            raise RuntimeError(f"{self.name}: a scene's group has no frame; use `for_run`")

    def for_run(self) -> Self:
        """Return a copy with separate memory for all that a run writes; it shares the rest."""
        own = copy(self)
        own.local_kernel, own._of_run = own._accumulator(), True
        return own

    def _accumulator(self) -> LocalKernel | None:
        """Return a new `local_kernel` with separate memory; None if `accumulate` is overridden."""
        return None

    def kernel_parameters(self) -> np.ndarray:
        """Return the numbers that ``gradient_kernel`` needs besides S q, in the order it expects.

        Numbers that change once per frame come from the last call of ``begin_frame``.
        """
        raise NotImplementedError(f"{self.name} has no gradient kernel")

    def project(self, y: np.ndarray) -> np.ndarray:
        """Return the projections p(y) (e p, 3) of all elements at ``y`` (N, 3) m."""
        return self.project_elements(y, np.arange(self.elements))

    def sampler(self, elements: np.ndarray) -> LocalKernel:
        """Return a kernel that writes the projections of ``elements`` (m,) int64 to a flat array.

        Callers pass the address of that array in place of the address of the right-hand side.
        """
        raise NotImplementedError(f"{self.name} has no sampler")

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """Return projections (m p, 3) at ``y`` (N, 3) m, in the order of ``elements`` (m,)."""
        elements = np.ascontiguousarray(elements, dtype=np.int64)
        return self.sampler(elements).projections(y, self.rows_per_element * len(elements))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) in place; return the energy, J."""
        self._require_frame()
        own = self.local_kernel or self.for_run().local_kernel
        if own is None:
            raise NotImplementedError(f"{self.name} has neither local kernel nor accumulate")
        return own.accumulate(y, rhs)

    @abstractmethod
    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """Return p_e (m, p, 3) of ``elements`` (m,) from ``d`` = S_e q (m, p, 3), by NumPy only."""

    @abstractmethod
    def restricted(
        self, elements: np.ndarray, factors: np.ndarray
    ) -> tuple["ConstraintGroup", np.ndarray]:
        """Return a group `for_run` of the given ``elements`` (m,) only, and the vertices it uses.

        Weights are multiplied by ``factors`` (m,); vertices (n,) are indices of the whole mesh.
        """

    def system_matrix(self) -> sparse.csr_array:
        """Return the matrix S^T W S, (N, N) CSR."""
        return (self.S.T @ self.S.multiply(self.row_weights[:, None])).tocsr()

    def roundoff(self, q: np.ndarray) -> float:
        """Estimate the rounding errors in S q at ``q`` (N, 3) m: eps || |S| |q| ||_F."""
        return float(np.finfo(float).eps * np.linalg.norm(abs(self.S) @ np.abs(q)))


class StencilGroup(ConstraintGroup):
    """A group whose elements all have the same number m of vertices.

    stencil : (e, m) int32 vertex indices
    operator : (e, p, m) dense element operators: S_e q = operator[e] @ q[stencil[e]]
    """

    stencil: np.ndarray
    operator: np.ndarray
    per_element: tuple[str, ...] = ()
    """Names of further attributes that are arrays with one entry per element."""

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
        return part.for_run(), vertices

    def _assemble(self, vertices: int) -> None:
        e, p, m = self.operator.shape
        rows = np.repeat(np.arange(e * p), m)
        columns = np.repeat(self.stencil[:, None, :], p, axis=1).ravel()
        self.S = sparse.csr_array((self.operator.ravel(), (rows, columns)), shape=(e * p, vertices))


def require_cells(mesh: Mesh, kind: str, effect: str) -> np.ndarray:
    """Return the cells ``kind`` ("triangles" or "tetrahedra") of ``mesh`` as an int32 array;
    SceneError if the mesh has none, or if it is a volume mesh and ``kind`` is "triangles"."""
    cells = getattr(mesh, kind)
    if kind == "triangles" and len(mesh.tetrahedra):
        raise SceneError(f"effect '{effect}' needs a surface mesh, this mesh has tetrahedra")
    if len(cells) == 0:
        way = "" if kind == "triangles" else "; fTetWild or gmsh make them from a closed surface"
        raise SceneError(f"effect '{effect}' needs {kind}, this mesh has none{way}")
    return np.ascontiguousarray(cells, dtype=np.int32)


def directions(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit vectors (zero for a zero vector) and lengths (..., 1) of ``a`` (..., 3)."""
    # scale the vectors so that their squares neither overflow nor underflow
    largest = np.abs(a).max(axis=-1, keepdims=True)
    part = a / np.where(largest > 0.0, largest, 1.0)
    length = np.linalg.norm(part, axis=-1, keepdims=True)
    return part / np.where(length > 0.0, length, 1.0), largest * length
