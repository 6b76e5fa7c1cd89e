"""Catalogue of the hard cases: scenes, each with a name, of extreme meshes, states or settings."""

from functools import partial
from typing import Any

import numpy as np

from pdrom.core import config_file
from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.generators import bar, boundary, cloth
from pdrom.model.mesh.types import Mesh
from study.experiments.hard_cases import record
from study.experiments.hard_cases.record import HardCase, Shape, scales, scrambled

# Mesh files in config/scenes/meshes, which the experiment declares as its inputs.
MESHES = ("hard_disc.obj", "hard_starfish_shell.obj", "hard_starfish.vtu", "hard_torus.vtu")

GRAVITY = {"effect": "gravity"}
FLOOR = {"effect": "floor"}
LEFT = {"effect": "pins", "select": "left"}

BENDING = {"effect": "bending", "weight": 1e-1}
SPRING = {"effect": "spring", "weight": 1e6}
STRAIN = {"effect": "strain", "weight": 1e7}
TETRAHEDRON = {"effect": "tetrahedron_strain", "weight": 1e6}
ROTATION = {"effect": "deformation_gradient", "weight": 1e8}
VOLUME = {"effect": "volume", "weight": 1e6}
AREA = {"effect": "area", "weight": 1e6}

# Names of the checks for hard cases: FREE for a body that nothing holds or touches, CALM if it also
# starts at rest without forces, FORCED for all others.
FREE = ("finite", "bounded", "objective", "momentum", "determinism")
CALM = (*FREE, "energy")
FORCED = ("finite", "bounded", "objective", "determinism")


def sheet(wave: float = 0.0) -> Mesh:
    """A horizontal sheet of 36 vertices, with waves of the height ``wave`` (m)."""
    return cloth(6, 6, "xz", wave=wave)


def small_bar() -> Mesh:
    """A bar of 45 vertices, 80 tetrahedra."""
    return bar(5, 3, 3)


def one_triangle() -> Mesh:
    """A single triangle."""
    return Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32))


def one_tetrahedron() -> Mesh:
    """A single tetrahedron."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    tetrahedra = np.array([[0, 1, 2, 3]], np.int32)
    return Mesh(points, boundary(tetrahedra), tetrahedra)


def scaled(mesh: Mesh, *factors: float) -> Mesh:
    """Return ``mesh`` with its axes scaled by ``factors`` (one for all axes, or three)."""
    return Mesh(mesh.points * np.array(factors), mesh.triangles, mesh.tetrahedra)


def shifted(mesh: Mesh, *offset: float) -> Mesh:
    """Return ``mesh`` moved by ``offset`` (x, y, z), m."""
    return Mesh(mesh.points + np.array(offset), mesh.triangles, mesh.tetrahedra)


def _case(
    name: str, why: str, holds: tuple[str, ...], mesh: Shape, *effects: dict, **rest: Any
) -> HardCase:
    """Return a `HardCase`; ``rest``: its fields start, bound and slow, and arguments of `build`."""
    own = {key: rest.pop(key) for key in ("start", "bound", "slow") if key in rest}
    return HardCase(name, why, holds, mesh, effects, rest, **own)


def _heavy_and_light(mesh: Mesh) -> np.ndarray:
    """Masses (N,) in kg that span eight decades, in random order."""
    order = np.random.default_rng(3).permutation(mesh.vertices)
    return np.logspace(-4, 4, mesh.vertices)[order]


def _all_but(*free: int) -> dict:
    """Pins that hold every vertex of `sheet` except the vertices ``free``."""
    held = tuple(int(v) for v in np.setdiff1d(np.arange(sheet().vertices), free))
    return {"effect": "pins", "select": held}


def _two_sheets(*offset: float) -> Mesh:
    """Two sheets that are not connected, the second one moved by ``offset`` (x, y, z), m."""
    first, second = sheet(), shifted(sheet(), *offset)
    cells = np.concatenate([first.triangles, second.triangles + first.vertices]).astype(np.int32)
    return Mesh(np.concatenate([first.points, second.points]), cells)


def _one_bad_element() -> Mesh:
    """A bar with one vertex moved almost into the opposite face of one tetrahedron."""
    mesh = small_bar()
    points = mesh.points.copy()
    corners = points[mesh.tetrahedra[1]]
    centroid = corners[1:].mean(axis=0)
    points[mesh.tetrahedra[1, 0]] = centroid + 1e-6 * (corners[0] - centroid)
    return Mesh(points, mesh.triangles, mesh.tetrahedra)


def _squashed() -> list[HardCase]:
    """Sheets and bars that start flattened to a plane, a line or a point."""
    bar = "every tetrahedron is flattened to a {}: F is singular"
    flat = "every triangle is collinear: the sheet is a {}"
    kinds = (
        ("bar_{}_strain", small_bar, TETRAHEDRON, bar),
        ("bar_{}_rotation", small_bar, ROTATION, bar),
        ("sheet_{}_strain", sheet, STRAIN, flat),
        ("sheet_{}_spring", sheet, SPRING, flat),
    )
    to = {"plane": (1, 1, 0), "line": (1, 0, 0), "point": (0, 0, 0)}
    return [
        _case(name.format(target), why.format(target), CALM, mesh, group, start=scales(*sides))
        for target, sides in to.items()
        for name, mesh, group, why in kinds
        if mesh is not sheet or target != "plane"  # a sheet at rest is a plane already
    ]


def _states() -> list[HardCase]:
    """Scenes that are extreme only in their initial positions, such as inverted elements."""
    three = (BENDING, SPRING, STRAIN)
    turn = record.mapped((-1, 0, 0), (0, -1, 0), (0, 0, 1))
    cases = [
        _case("inverted_strain", "all tetrahedra are inverted: the signed singular values tie",
              (*CALM, "recovers"), small_bar, TETRAHEDRON, start=scales(1, 1, -1), frames=60),
        _case("inverted_rotation",
              "all tetrahedra are inverted: the nearest rotation is not unique",
              (*CALM, "recovers"), small_bar, ROTATION, start=scales(1, 1, -1), frames=60),
        _case("inverted_uneven",
              "all tetrahedra are inverted, and one axis is the nearest to turn back",
              (*CALM, "recovers"), small_bar, ROTATION, start=scales(1.2, 1.1, -0.7), frames=60),
        _case("scrambled_strain", "vertices at random in a box", CALM, small_bar, TETRAHEDRON,
              start=scrambled()),
        _case("scrambled_rotation", "vertices at random in a box", CALM, small_bar, ROTATION,
              start=scrambled()),
        _case("scrambled_sheet", "vertices at random in a box, three groups", CALM,
              partial(sheet, wave=0.05), *three, start=scrambled()),
        _case("scrambled_far", "vertices at random in a box of a million extents", CALM, sheet,
              SPRING, start=scrambled(1e6)),
        _case("merged_spring", "edges of length zero: no direction to project on", CALM, sheet,
              SPRING, start=record.pairs_merged),
        _case("merged_strain", "triangles with two corners in one place", CALM, sheet, STRAIN,
              start=record.pairs_merged),
        _case("folded", "vertices of different elements coincide, cells of the fold are flat", CALM,
              partial(sheet, wave=0.05), *three, start=record.folded),
        _case("bending_mirrored", "every vertex is on the wrong side of its normal", FREE,
              partial(sheet, wave=0.1), BENDING, start=scales(1, -1, 1)),
        _case("bending_collapsed", "no vertex has a normal", FREE, partial(sheet, wave=0.1),
              BENDING, start=scales(0, 0, 0)),
    ]  # fmt: skip
    for label, mesh, group in (
        ("strain", sheet, STRAIN),
        ("tetrahedron", small_bar, TETRAHEDRON),
        ("rotation", small_bar, ROTATION),
    ):
        cases += [
            _case(f"repeated_{label}", "all singular values are equal: their vectors are arbitrary",
                  CALM, mesh, group, start=scales(1.3, 1.3, 1.3)),
            _case(f"nearly_repeated_{label}", "singular values differ by round-off only", CALM,
                  mesh, group, start=record.noisy(scales(1.3, 1.3, 1.3), 1e-15)),
            _case(f"half_turn_{label}", "the nearest rotation turns by pi: nothing may move",
                  (*CALM, "still"), mesh, group, start=turn),
        ]  # fmt: skip
    return cases


def _sizes() -> list[HardCase]:
    """Scenes with volume or area constraints; the projection of an element may not be unique."""
    lying = record.mapped((1, 0, 5), (0, 1, 0), (0, 0, 1))
    # a large bound on the bounding box: a body of constant volume or area may stretch without limit
    loose, cases = 40.0, []
    for label, mesh, group in (("volume", small_bar, VOLUME), ("area", sheet, AREA)):
        cases += [
            _case(f"{label}_flat", "every element has lost its size along one axis", CALM, mesh,
                  group, start=scales(1, 1, 0), bound=loose),
            _case(f"{label}_point", "all vertices in one point: no direction to grow in", CALM,
                  mesh, group, start=scales(0, 0, 0), bound=loose),
            _case(f"{label}_scrambled",
                  "vertices at random in a box: needles of the right size are near", CALM, mesh,
                  group, start=scrambled(), bound=loose),
            _case(f"{label}_swollen",
                  "three times as large along each axis: several shapes are near", CALM, mesh,
                  group, start=scales(3, 3, 3), bound=loose),
            _case(f"{label}_sheared", "sheared five times over: nothing may move", (*CALM, "still"),
                  mesh, group, start=lying),
        ]  # fmt: skip
    return [
        *cases,
        _case("volume_inverted", "all tetrahedra are inverted: any axis may turn back", CALM,
              small_bar, VOLUME, start=scales(1, 1, -1), bound=loose, frames=60),
        _case("volume_large_step", "a soft bar that keeps its volume, h = 0.1 s", FORCED, small_bar,
              VOLUME, TETRAHEDRON | {"weight": 1e5}, GRAVITY, LEFT, bound=4.0, time_step=0.1),
        _case("area_falling", "a soft sheet that keeps its area hangs and touches the floor",
              FORCED, sheet, AREA, SPRING | {"weight": 1e2}, GRAVITY, FLOOR, LEFT, bound=4.0),
    ]  # fmt: skip


def _meshes() -> list[HardCase]:
    """Scenes with irregular meshes, such as needles and slivers."""
    three = (BENDING, SPRING, STRAIN)
    return [
        _case("needles", "needle triangles, ten thousand times longer than wide", FORCED,
              lambda: scaled(sheet(wave=0.05), 1, 1e-4, 1e-4), *three, GRAVITY, LEFT, bound=4.0),
        _case("slivers", "every tetrahedron has quality 1e-6", FORCED,
              lambda: scaled(small_bar(), 1, 1, 1e-6), TETRAHEDRON, GRAVITY, LEFT, bound=4.0),
        _case("one_sliver", "one sliver among regular tetrahedra", FORCED, _one_bad_element,
              ROTATION, GRAVITY, LEFT),
        _case("one_triangle", "a mesh of one element", CALM, one_triangle, SPRING, STRAIN,
              start=scales(1.5, 0.5, 1)),
        _case("one_tetrahedron", "a mesh of one element, inverted", (*CALM, "recovers"),
              one_tetrahedron, TETRAHEDRON, start=scales(1, 1, -1), frames=60),
        _case("two_components", "two sheets without a connection, one held and one free", FORCED,
              partial(_two_sheets, 3.0, 0.5, 0.0), SPRING, GRAVITY, FLOOR, LEFT, bound=3.0),
        _case("tiny_extent", "a bar of a micrometre", CALM, lambda: scaled(small_bar(), 1e-6),
              ROTATION, start=scales(1.2, 1.2, 0), vertex_mass=1e-12),
        _case("huge_extent", "a bar of a thousand kilometres", CALM,
              lambda: scaled(small_bar(), 1e6), ROTATION, start=scales(1.2, 1.2, 0)),
        _case("far_away", "a sheet a billion extents from the origin: edges cancel to seven digits",
              FORCED, lambda: shifted(sheet(), 1e9, 0, 0), SPRING, GRAVITY),
        _case("flat_bending", "the group does nothing: a flat sheet has no curvature to keep", FREE,
              sheet, BENDING, GRAVITY),
    ]  # fmt: skip


def _settings() -> list[HardCase]:
    """Scenes with extreme weights, masses, time steps or forces."""
    held = (GRAVITY, LEFT)
    return [
        _case("stiffness_ratio", "stiffness of the groups differs by twelve decades", FORCED,
              partial(sheet, wave=0.05), BENDING | {"weight": 1e-4}, SPRING | {"weight": 1e8},
              STRAIN | {"weight": 1e-4}, *held),
        _case("stiffest", "stiffness at its limit, held: masses are round-off, pins are not",
              FORCED, sheet, SPRING | {"weight": 1e16}, LEFT, start=scales(1.1, 1, 1),
              time_step=1.0),
        _case("stiffest_free",
              "stiffness at its limit, free: a translation of the body is round-off", ("refused",),
              sheet, SPRING | {"weight": 1e16}, start=scales(1.1, 1, 1), time_step=1.0),
        _case("softest", "forces far below round-off", FREE, sheet, SPRING | {"weight": 1e-300},
              GRAVITY),
        _case("denormal_weight", "a weight below the normal range of numbers", FREE, sheet,
              SPRING | {"weight": 1e-320}, GRAVITY),
        _case("light", "masses are round-off beside the stiffness", ("refused",), sheet, SPRING,
              start=scales(1.1, 1, 1), vertex_mass=1e-12),
        _case("light_held", "masses of nothing, held", FORCED, sheet, SPRING, *held,
              start=scales(1.1, 1, 1), vertex_mass=1e-100),
        _case("overdamped", "the explicit drag turns velocities round and enlarges them",
              ("refused",), sheet, SPRING, {"effect": "damping", "rate": 1e3}),
        _case("mass_ratio", "masses over eight decades, held", FORCED, sheet, SPRING, STRAIN, *held,
              bound=4.0, masses=_heavy_and_light),
        _case("mass_ratio_free", "masses over eight decades, free", CALM, small_bar, TETRAHEDRON,
              start=scales(1.3, 0.7, -1), masses=_heavy_and_light),
        _case("smallest_step", "h = 1e-5 s: inertia is everything", FORCED, sheet, SPRING, *held,
              time_step=1e-5),
        _case("small_step", "h = 1e-3 s: K = 10 is more than it needs", FORCED, small_bar, ROTATION,
              *held, time_step=1e-3),
        _case("large_step", "h = 0.1 s: the bar falls a tenth of its extent in a frame", FORCED,
              small_bar, TETRAHEDRON, *held, time_step=0.1),
        _case("largest_step", "h = 1 s: the sheet falls five extents in a frame", FORCED, sheet,
              SPRING, *held, bound=4.0, time_step=1.0),
        _case("one_iteration", "K = 1: the local and the global step never agree", FORCED, sheet,
              STRAIN, *held, iterations=1),
        _case("one_iteration_inverted", "K = 1 and all tetrahedra inverted", (*CALM, "recovers"),
              small_bar, ROTATION, start=scales(1, 1, -1), iterations=1, frames=60),
        _case("heavy_gravity", "gravity a thousand times the earth's", FORCED, sheet, SPRING, FLOOR,
              LEFT, {"effect": "gravity", "acceleration": [0, -9810, 0]}, bound=20.0),
        _case("long_run", "two thousand frames", FORCED, sheet, SPRING, *held, slow=True,
              frames=2000),
        _case("long_free", "two thousand frames from an uneven stretch", CALM, small_bar,
              TETRAHEDRON, start=scales(1.4, 0.8, -0.9), slow=True, frames=2000),
    ]  # fmt: skip


def _boundaries() -> list[HardCase]:
    """Scenes with contradictory or extreme pins and handles, or with a floor."""
    tear = {"effect": "translate", "select": "right", "offset": [100, 0, 0], "over": 1, "until": 10}
    twist = {"effect": "rotate", "select": "right", "axis": "x", "degrees": 180, "over": 1}
    again = {"effect": "translate", "select": "left", "offset": [1, 0, 0], "over": 5}
    return [
        _case("contradiction", "pins and a handle want the same vertices in different places",
              ("refused",), sheet, SPRING, LEFT, again),
        _case("torn", "a handle moves a hundred extents in one frame, and lets go", FORCED, sheet,
              SPRING, LEFT, tear),
        _case("snapped", "a handle turns the end by pi in one frame", FORCED, small_bar, ROTATION,
              LEFT, twist),
        _case("one_free_vertex", "every vertex but one is held", FORCED, sheet, SPRING, GRAVITY,
              _all_but(14)),
        _case("nothing_free", "every vertex is held: there is no system to solve",
              (*FORCED, "still"), sheet, SPRING, GRAVITY, _all_but()),
        _case("floor_at_speed", "the floor is hit at ten kilometres a second", FORCED, small_bar,
              TETRAHEDRON, GRAVITY, FLOOR, start=record.falling(1e4), bound=20.0),
        _case("below_floor", "the start lies below the floor", FORCED, sheet, SPRING, GRAVITY,
              FLOOR, start=record.lowered(-5.0)),
        _case("kicked", "a kick of a kilometre a second", FREE, sheet, STRAIN,
              {"effect": "kick", "speed": 1e3, "seed": 1}, bound=100.0),
    ]  # fmt: skip


def _air() -> list[HardCase]:
    """Scenes with extreme drag or wind."""
    storm = {"effect": "wind", "velocity": [3e3, 9e3, 3e3]}
    return [
        _case("storm", "wind of ten thousand metres a second, held on one side", FORCED, sheet,
              SPRING, GRAVITY, LEFT, storm, bound=20.0),
        _case("storm_light", "the same wind takes a light sheet away in one frame", FORCED,
              partial(sheet, wave=0.05), STRAIN, storm, bound=20.0, vertex_mass=1e-2, frames=10),
        _case("syrup", "drag that stops the surface in far less than a frame", FORCED, small_bar,
              TETRAHEDRON, GRAVITY, {"effect": "drag", "coefficient": 1e12},
              start=scales(1.2, 1, 1)),
    ]  # fmt: skip


def _obstacles() -> list[HardCase]:
    """Scenes with obstacles: hits on edges, tunnelling, starts inside, no or infinite friction."""
    ball = {"effect": "sphere", "centre": [0, 1, 0], "radius": 0.4}
    edge = {"effect": "box", "lower": [-0.02, 1.0, -2], "upper": [0.03, 1.9, 2], "friction": 0.5}
    plate = {"effect": "box", "lower": [-9, 1, -9], "upper": [9, 1, 9]}
    around = {"effect": "box", "lower": [-2, 0, -2], "upper": [2, 4, 2]}
    slope = {"effect": "plane", "point": [0, 1.8, 0], "normal": [0.6, 0.8, 0]}
    wire = {"effect": "box", "lower": [-9, 1.9, 0.03], "upper": [9, 1.9, 0.03], "friction": 1.0}
    fast, sticky = record.falling(1e4), {"friction": float("inf")}
    return [
        _case("box_edge", "a sheet falls on the edges of a box narrower than its cells", FORCED,
              sheet, SPRING, GRAVITY, edge),
        _case("sphere_at_speed", "every vertex would pass the ball in one frame", FORCED, small_bar,
              TETRAHEDRON, GRAVITY, ball, start=fast, bound=4e3, time_step=0.1),
        _case("plate_at_speed", "a plate without thickness is hit at ten kilometres a second",
              FORCED, sheet, SPRING, GRAVITY, plate, start=fast, bound=20.0),
        _case("inside_sphere", "all vertices start inside the ball, some at its centre", FORCED,
              sheet, SPRING, ball | {"centre": [0, 2, 0], "radius": 0.9}, bound=4.0),
        _case("inside_box", "all vertices start inside the box", FORCED, small_bar, TETRAHEDRON,
              around, bound=10.0),
        _case("frictionless", "a slope without friction", FORCED, sheet, SPRING, GRAVITY, slope),
        _case("sticky", "a slope with infinite friction", FORCED, sheet, SPRING, GRAVITY,
              {**slope, **sticky}),
        _case("keys_at_speed",
              "a handle jumps a hundred extents to and fro, turns over, and lets go", FORCED, sheet,
              STRAIN, LEFT,
              {"effect": "keyframes", "select": "right", "until": 10, "keys": [
                  {"at": 1, "offset": [0, 50, 0], "turn": [720, 0, 180]},
                  {"at": 2, "offset": [0, -50, 0]}]}),
        _case("wire", "a box without width and height, thinner than any cell", FORCED, sheet,
              SPRING, GRAVITY, wire),
        _case("ball_large_step", "h = 1 s: the sheet falls past a small sticky ball in one frame",
              FORCED, sheet, SPRING, GRAVITY,
              {"effect": "sphere", "centre": [0, 0, 0], "radius": 0.1, **sticky}, bound=20.0,
              time_step=1.0),
        _case("below_slope", "all vertices start far behind a sticky slope", FORCED, small_bar,
              TETRAHEDRON, GRAVITY, { **slope, **sticky, "point": [0, 9, 0]}, bound=4.0),
        _case("slope_at_speed", "a sticky slope is passed by a thousand extents in one frame",
              FORCED, sheet, STRAIN, GRAVITY, {**slope, **sticky}, start=fast, bound=20.0,
              time_step=0.1),
        _case("vice", "two plates that overlap: whatever leaves one is inside the other", FORCED,
              small_bar, VOLUME, TETRAHEDRON | {"weight": 1e5}, GRAVITY,
              plate | {"lower": [-9, 0, -9], "upper": [9, 2.1, 9]},
              plate | {"lower": [-9, 1.9, -9], "upper": [9, 4, 9]}, bound=20.0),
    ]  # fmt: skip


def _unstructured() -> list[HardCase]:
    """Scenes with unstructured meshes: no two elements are alike, and none lies along an axis."""
    ring, skin, starfish, torus = (
        partial(read_mesh_file, config_file(f"scenes/meshes/{name}").resolve()) for name in MESHES
    )
    ball = {"effect": "sphere", "centre": [0, 1.6, 0.05], "radius": 0.3, "friction": 0.5}
    edge = {"effect": "box", "lower": [-0.02, 1.0, -2], "upper": [0.03, 1.7, 2], "friction": 0.5}
    storm = {"effect": "wind", "velocity": [3e3, 9e3, 3e3]}
    three = {"effect": "pins", "select": {"kind": "nearest", "point": [0, 2, 0], "count": 3}}
    return [
        _case("torus_inverted", "all tetrahedra of a torus are inverted", CALM, torus, ROTATION,
              start=scales(1, 1, -1), frames=60),
        _case("starfish_flat", "all tetrahedra of a starfish are flattened", CALM, starfish,
              TETRAHEDRON, start=scales(1, 0, 1)),
        _case("starfish_swollen", "a starfish three times as large along each axis", CALM, starfish,
              VOLUME, TETRAHEDRON | {"weight": 1e5}, start=scales(3, 3, 3)),
        _case("disc_crumpled", "a disc with a hole, crumpled into a third of its size", CALM, ring,
              STRAIN, BENDING, start=scrambled(0.3)),
        _case("disc_on_ball", "a disc falls on a ball as wide as its hole, beside the middle",
              FORCED, ring, SPRING, GRAVITY, ball),
        _case("torus_on_edge", "a torus falls on the edges of a box narrower than its elements",
              FORCED, torus, TETRAHEDRON, GRAVITY, edge),
        _case("shell_storm", "wind of ten thousand metres a second on a closed surface", FORCED,
              skin, SPRING, BENDING, GRAVITY, storm, three, bound=20.0),
    ]  # fmt: skip


def _collisions() -> list[HardCase]:
    """Scenes of bodies that collide with themselves."""
    apart = {"effect": "self_collision", "thickness": 0.18}
    return [
        _case("collision_folded", "vertices of different layers coincide, and fall as a heap",
              FORCED, sheet, SPRING, GRAVITY, FLOOR, apart, start=record.folded),
        _case("collision_point", "all vertices in one point, none of which may stay there", FORCED,
              small_bar, TETRAHEDRON, apart | {"thickness": 0.3}, start=scales(0, 0, 0), bound=4.0),
        _case("collision_thick", "a thickness as large as the sheet, crumpled", FORCED, sheet,
              SPRING, apart | {"thickness": 0.9}, start=scrambled(0.1), bound=4.0),
        _case("collision_at_speed", "two layers pass through each other in a tenth of a frame",
              FORCED, partial(_two_sheets, 0.0, 0.5, 0.0), SPRING, apart, start=record.meeting(1e4),
              bound=1e4),
        _case("collision_zero", "a thickness of zero", ("refused",), sheet, SPRING,
              apart | {"thickness": 0.0}),
    ]  # fmt: skip


PARTS = (
    _squashed, _states, _sizes, _meshes, _settings, _boundaries, _air, _obstacles, _collisions,
    _unstructured,
)  # fmt: skip
CASES: dict[str, HardCase] = {case.name: case for part in PARTS for case in part()}


def reducible_cases(slow: bool = False) -> list[str]:
    """Names of the hard cases that are not refused: the slow ones if ``slow``, else all others."""
    return [name for name, c in CASES.items() if c.slow == slow and c.holds != ("refused",)]
