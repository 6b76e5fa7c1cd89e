"""Edge springs: S q = q_b - q_a, projected to the rest length (Bouaziz et al. 2014, sect. 5.1)."""

from typing import Literal

import numpy as np

from pdrom.model.compiled import arithmetic, rows
from pdrom.model.compiled.arithmetic import add, choose_within, divide, multiply, subtract
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints import simplex
from pdrom.model.constraints.base import GroupConfig, directions
from pdrom.model.constraints.lanes import LANES, SMALLEST, lane_function, pack, take
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.mesh.types import Mesh

# each edge has GEOMETRY packed numbers: its weight and, at offset LENGTH, its rest length
LENGTH, GEOMETRY = 1, 2
REST = 3  # components x, y, z of an edge in the rest shape, packed in another array
# indices in a kernel's record: address of all rest edges, address of memory for a block of them
REST_EDGES, TAKEN_REST = simplex.ARRAYS, simplex.ARRAYS + 1
# squared lengths in this range neither overflow nor lose digits
LOW, HIGH = 1e-280, 1e280


@lane_function
def _squares(x, y, z):
    return arithmetic.add_product(arithmetic.add_product(multiply(x, x), y, y), z, z)


@lane_function
def _rest_lengths(x, y, z, length, rest, place):
    """Scale four edges x, y, z to rest ``length``; edges of length zero become ``rest`` edges."""
    square = _squares(x, y, z)
    factor = divide(length, arithmetic.square_root(square))
    px, py, pz = multiply(factor, x), multiply(factor, y), multiply(factor, z)
    if arithmetic.all_within(square, LOW, HIGH):
        return px, py, pz
    # edges are scaled, so that squares neither overflow nor underflow; if not finite, they stay so
    scale = add(add(arithmetic.magnitude(x), arithmetic.magnitude(y)), arithmetic.magnitude(z))
    inverse = divide(arithmetic.constant(1.0), add(scale, arithmetic.constant(SMALLEST)))
    ux, uy, uz = multiply(inverse, x), multiply(inverse, y), multiply(inverse, z)
    factor = divide(length, arithmetic.square_root(_squares(ux, uy, uz)))
    sx = choose_within(scale, 0.0, 0.0, rows.load(rest, place), multiply(factor, ux))
    sy = choose_within(scale, 0.0, 0.0, rows.load(rest, place + LANES), multiply(factor, uy))
    sz = choose_within(scale, 0.0, 0.0, rows.load(rest, place + 2 * LANES), multiply(factor, uz))
    return (
        choose_within(square, LOW, HIGH, px, sx),
        choose_within(square, LOW, HIGH, py, sy),
        choose_within(square, LOW, HIGH, pz, sz),
    )


@lane_function
def _project_block(work, geometry, geometry_block, rest, rest_block):
    """Write projections p of the edges in ``work`` to it; ``rest``: edges in the rest shape."""
    for lane in range(0, LANES, WIDTH):
        edge, p = simplex.EDGE * LANES + lane, simplex.P * LANES + lane
        px, py, pz = _rest_lengths(
            rows.load(work, edge),
            rows.load(work, edge + LANES),
            rows.load(work, edge + 2 * LANES),
            rows.load(geometry, (geometry_block * GEOMETRY + LENGTH) * LANES + lane),
            rest,
            rest_block * REST * LANES + lane,
        )
        rows.store(work, p, px)
        rows.store(work, p + LANES, py)
        rows.store(work, p + 2 * LANES, pz)


@local_kernel
def _project(y_place, p_place, record):
    y, _, corners, geometry, _, work, count = simplex.arguments(
        y_place, p_place, record, 2, GEOMETRY
    )
    elements, taken, taken_geometry = simplex.samples(record, 2, GEOMETRY)
    entries = rows.indices(record, TAKEN_REST + 1)
    rest = rows.doubles(entries[REST_EDGES], count * REST * LANES)
    taken_rest = rows.doubles(entries[TAKEN_REST], REST * LANES)
    p = rows.doubles(p_place, 3 * len(elements))
    for start in range(0, len(elements), LANES):
        take(corners, 2, elements, start, taken)
        take(geometry, GEOMETRY, elements, start, taken_geometry)
        take(rest, REST, elements, start, taken_rest)
        simplex.gather_edges(y, taken, 0, 1, work)
        _project_block(work, taken_geometry, 0, taken_rest, 0)
        simplex.store_projections(work, 1, start, p)
    return 0.0


@local_kernel
def _accumulate(y_place, rhs_place, record):
    y, rhs, corners, geometry, _, _, count = simplex.arguments(
        y_place, rhs_place, record, 2, GEOMETRY
    )
    rest = rows.doubles(rows.indices(record, REST_EDGES + 1)[REST_EDGES], count * REST * LANES)
    none = arithmetic.constant(0.0)
    energies = none
    for block in range(count):
        numbers = block * GEOMETRY * LANES
        for lane in range(0, LANES, WIDTH):
            a = block * 2 * LANES + lane
            b = a + LANES
            start, end = simplex.corner_rows(y, corners, a), simplex.corner_rows(y, corners, b)
            dx, dy, dz, _ = simplex.edge_columns(start, end)
            length = rows.load(geometry, numbers + LENGTH * LANES + lane)
            place = block * REST * LANES + lane
            px, py, pz = _rest_lengths(dx, dy, dz, length, rest, place)
            w = rows.load(geometry, numbers + simplex.WEIGHT * LANES + lane)
            square = _squares(subtract(dx, px), subtract(dy, py), subtract(dz, pz))
            energies = arithmetic.add_product(energies, w, square)
            forces = arithmetic.transposed(multiply(w, px), multiply(w, py), multiply(w, pz), none)
            simplex.add_to(rhs, corners, b, forces)
            simplex.take_from(rhs, corners, a, forces)
    return 0.5 * arithmetic.total(energies)


@gradient_kernel
def _project_gradients(d_place, parameters, p_place, m):
    d, p = rows.doubles(d_place, 3 * m), rows.doubles(p_place, 3 * m)
    packed = (m + LANES - 1) // LANES * LANES
    geometry = rows.doubles(parameters, packed * GEOMETRY)
    rest = rows.doubles(parameters + 8 * packed * GEOMETRY, packed * REST)
    work = np.zeros(simplex.SIZE * LANES)
    for start in range(0, m, LANES):
        simplex.copy_rows(d, 1, start, work, simplex.EDGE)
        _project_block(work, geometry, start // LANES, rest, start // LANES)
        simplex.store_projections(work, 1, start, p)


class EdgeSpring(simplex.SimplexGroup):
    """One constraint per edge of the mesh; in a volume mesh, per edge of its tetrahedra.

    p has the direction of the edge and its rest length. An edge of length zero has no direction;
    its p is the rest edge.
    """

    class Config(GroupConfig):
        """Weight w per edge, N/m."""

        effect: Literal["spring"] = "spring"

    cells = "edge"
    unit = "m"
    rows_per_element = 1
    per_element = ("rest",)
    reordered = False  # the edges of a mesh are sorted by their vertices already
    _own_memory = REST * LANES
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients
    manifold = "length"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = mesh.edges()
        self.rest = mesh.points[self.stencil[:, 1]] - mesh.points[self.stencil[:, 0]]
        self.weights = np.full(len(self.stencil), self.element_weights(mesh))
        self.operator = np.tile(np.array([[[-1.0, 1.0]]]), (len(self.stencil), 1, 1))
        self._assemble(mesh.vertices)

    def _assemble(self, vertices: int) -> None:
        # rest edges are not in `_geometry`: only edges whose current length is zero need them
        self._own_arrays = (pack(self.rest),)
        super()._assemble(vertices)

    def _extra(self) -> list[np.ndarray]:
        return [np.linalg.norm(self.rest, axis=1)]

    def kernel_parameters(self) -> np.ndarray:
        return np.concatenate([self._geometry, self._own_arrays[0]])

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        rest = self.rest[elements, None, :]
        direction, length = directions(d)
        rest_length = np.linalg.norm(rest, axis=2, keepdims=True)
        return np.where(length > 0.0, direction * rest_length, rest)
