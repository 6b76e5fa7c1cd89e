"""Elements of all groups one after the other, for methods that go from element to element."""

from dataclasses import dataclass, fields

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.base import StencilGroup
from pdrom.model.constraints.lanes import lane_function
from pdrom.model.constraints.spring import EdgeSpring
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.clamping import decompose

KINDS = ("length", "clamped")  # manifolds whose residual and Hessian are known in closed form


@dataclass(frozen=True)
class Elements:
    """e elements; one with p rows has p + 1 corners.

    rows : (e,) p
    corners : (e, 4) vertices, filled up with zeros
    operator : (e, 3, 4), of each the first p rows and p + 1 columns
    weights, low, high : (e,) weight, and range of the singular values
    fallback : (e, 3) direction of an element that has shrunk to a point
    """

    rows: np.ndarray
    corners: np.ndarray
    operator: np.ndarray
    weights: np.ndarray
    low: np.ndarray
    high: np.ndarray
    fallback: np.ndarray

    @classmethod
    def of(cls, scene: Scene, method: str) -> "Elements":
        """All elements of a scene; SceneError if a group is none that ``method`` takes."""
        parts = []
        for group in scene.groups:
            if group.manifold not in KINDS or not isinstance(group, StencilGroup):
                raise SceneError(
                    f"scene '{scene.config.name}', effect '{group.name}': method '{method}' takes "
                    "springs, triangle strain and tetrahedra only"
                )
            parts.append(_arrays(group))
        return cls(
            *(np.ascontiguousarray(np.concatenate(part)) for part in zip(*parts, strict=True))
        )

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """Arrays for compiled code: rows, corners, operator, weights, low, high, fallback."""
        return (
            self.rows, self.corners, self.operator, self.weights, self.low, self.high,
            self.fallback,
        )  # fmt: skip

    def by_colour(self) -> "Elements":
        """The elements in an order in which neighbours in the list share no vertex.

        Elements of one colour share none; the first colour that is free at all corners is taken.
        The processor then overlaps the work on several of them.
        """
        colours = _colours(self.rows, self.corners, int(self.corners.max(initial=0)) + 1)
        order = np.argsort(colours, kind="stable")
        return Elements(*(np.ascontiguousarray(getattr(self, f.name)[order]) for f in fields(self)))

    def around(self, vertices: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Elements at each of ``vertices`` N: starts (N + 1,), elements, and which corner it is."""
        used = np.arange(4) <= self.rows[:, None]
        element, corner = np.nonzero(used)
        vertex = self.corners[used]
        order = np.argsort(vertex, kind="stable")
        starts = np.searchsorted(vertex[order], np.arange(vertices + 1))
        return starts, element[order], corner[order]


def _arrays(group: StencilGroup) -> tuple[np.ndarray, ...]:
    e, p, m = group.operator.shape
    corners = np.zeros((e, 4), np.int64)
    corners[:, :m] = group.stencil
    operator = np.zeros((e, 3, 4))
    operator[:, :p, :m] = group.operator
    fallback = np.tile([1.0, 0.0, 0.0], (e, 1))
    if isinstance(group, EdgeSpring):
        fallback = group.rest
        low = high = np.linalg.norm(fallback, axis=1)
    else:
        low, high = (np.full(e, bound) for bound in group.kernel_parameters())
    return np.full(e, p, np.int64), corners, operator, group.weights, low, high, fallback


@compiled
def _colours(rows, corners, vertices):
    """Colours (e,) of elements; the last of 63 is for those that no other colour is left for."""
    taken = np.zeros(vertices, np.int64)
    colours = np.empty(len(rows), np.int64)
    for e in range(len(rows)):
        used = 0
        for corner in range(rows[e] + 1):
            used |= taken[corners[e, corner]]
        colour = 0
        while colour < 62 and (used >> colour) & 1:
            colour += 1
        for corner in range(rows[e] + 1):
            taken[corners[e, corner]] |= 1 << colour
        colours[e] = colour
    return colours


def workspace() -> tuple[np.ndarray, ...]:
    """Arrays that `decompose_element` works with: D, u, v, sigma."""
    return np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)


@lane_function
def decompose_element(y, e, p, corners, operator, fallback, d, u, v, sigma):
    """Decompose S_e y, see `study.experiments.alternatives.solvers.clamping.decompose`.

    Arrays are passed one by one: taking them from a tuple for each element costs more than the
    decomposition, because compiled code counts who holds them.

    Parameters
    ----------
    y : padded positions, flat, m
    e, p : number of the element and of its rows
    corners, operator, fallback : of all elements, see `Elements`
    d, u, v, sigma : of `workspace`, written
    """
    d[:] = 0.0
    for corner in range(p + 1):
        place = WIDTH * corners[e, corner]
        for row in range(p):
            for k in range(3):
                d[row, k] += operator[e, row, corner] * y[place + k]
    decompose(d, p, (fallback[e, 0], fallback[e, 1], fallback[e, 2]), u, v, sigma)
