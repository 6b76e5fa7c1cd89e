"""The hard cases, by name: one module because it is one list, without logic of its own."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from pdrom.core.project import config_file
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.types import Mesh
from study.experiments.hard_cases.case import (
    HardCase,
    Recipe,
    both,
    falling,
    folded,
    lowered,
    mapped,
    meeting,
    noisy,
    one_tetrahedron,
    one_triangle,
    pairs_merged,
    scaled,
    scales,
    scrambled,
    sheet,
    shifted,
    small_bar,
)

# Files in config/scenes/meshes, which the job names among its sources.
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

# Nothing pushes, nothing is held: everything that theory guarantees.
FREE = ("finite", "bounded", "objective", "momentum", "determinism")
CALM = (*FREE, "energy")
FORCED = ("finite", "bounded", "objective", "determinism")


def _with(effect: dict, **changes: object) -> dict:
    return {**effect, **changes}


def _scene(mesh: Callable[[], Mesh], *effects: dict, **settings: Any) -> Recipe:
    return Recipe(mesh, effects, settings)


def _heavy_and_light(mesh: Mesh) -> np.ndarray:
    """Masses over eight decades, heavy next to light."""
    order = np.random.default_rng(3).permutation(mesh.vertices)
    return np.logspace(-4, 4, mesh.vertices)[order]


def _all_but(*free: int) -> dict:
    """Pins on every vertex of the sheet but ``free``."""
    held = tuple(int(v) for v in np.setdiff1d(np.arange(sheet().vertices), free))
    return {"effect": "pins", "select": held}


def _two_sheets() -> Mesh:
    return both(sheet(), shifted(sheet(), 3.0, 0.5, 0.0))


def _two_layers() -> Mesh:
    return both(sheet(), shifted(sheet(), 0.0, 0.5, 0.0))


def _one_bad_element() -> Mesh:
    """A bar one vertex of which all but touches the opposite face of a tetrahedron."""
    mesh = small_bar()
    points = mesh.points.copy()
    corners = points[mesh.tetrahedra[1]]
    centroid = corners[1:].mean(axis=0)
    points[mesh.tetrahedra[1, 0]] = centroid + 1e-6 * (corners[0] - centroid)
    return Mesh(points, mesh.triangles, mesh.tetrahedra)


def _squashed() -> list[HardCase]:
    """Sheets and bars flattened to a plane, a line, a point; needles and merged vertices."""
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
        HardCase(name.format(target), _scene(mesh, group), why.format(target), CALM, scales(*sides))
        for target, sides in to.items()
        for name, mesh, group, why in kinds
        if mesh is not sheet or target != "plane"  # a sheet is a plane already
    ]


def _states() -> list[HardCase]:
    """Cases: regular scenes that start in irregular states."""
    three = (BENDING, SPRING, STRAIN)
    turn = mapped((-1, 0, 0), (0, -1, 0), (0, 0, 1))
    cases = [
        HardCase("inverted_strain", _scene(small_bar, TETRAHEDRON, frames=60),
                 "all tetrahedra are inverted: the signed singular values tie",
                 (*CALM, "recovers"), scales(1, 1, -1)),
        HardCase("inverted_rotation", _scene(small_bar, ROTATION, frames=60),
                 "all tetrahedra are inverted: the nearest rotation is not unique",
                 (*CALM, "recovers"), scales(1, 1, -1)),
        HardCase("inverted_uneven", _scene(small_bar, ROTATION, frames=60),
                 "all tetrahedra are inverted, and one axis is the nearest to turn back",
                 (*CALM, "recovers"), scales(1.2, 1.1, -0.7)),
        HardCase("scrambled_strain", _scene(small_bar, TETRAHEDRON),
                 "vertices at random in a box", CALM, scrambled()),
        HardCase("scrambled_rotation", _scene(small_bar, ROTATION),
                 "vertices at random in a box", CALM, scrambled()),
        HardCase("scrambled_sheet", _scene(partial(sheet, wave=0.05), *three),
                 "vertices at random in a box, three groups", CALM, scrambled()),
        HardCase("scrambled_far", _scene(sheet, SPRING),
                 "vertices at random in a box of a million extents", CALM, scrambled(1e6)),
        HardCase("merged_spring", _scene(sheet, SPRING),
                 "edges of length zero: no direction to project on", CALM, pairs_merged),
        HardCase("merged_strain", _scene(sheet, STRAIN),
                 "triangles with two corners in one place", CALM, pairs_merged),
        HardCase("folded", _scene(partial(sheet, wave=0.05), *three),
                 "vertices of different elements coincide, cells of the fold are flat", CALM,
                 folded),
        HardCase("bending_mirrored", _scene(partial(sheet, wave=0.1), BENDING),
                 "every vertex is on the wrong side of its normal", FREE, scales(1, -1, 1)),
        HardCase("bending_collapsed", _scene(partial(sheet, wave=0.1), BENDING),
                 "no vertex has a normal", FREE, scales(0, 0, 0)),
    ]  # fmt: skip
    for label, mesh, group in (
        ("strain", sheet, STRAIN),
        ("tetrahedron", small_bar, TETRAHEDRON),
        ("rotation", small_bar, ROTATION),
    ):
        cases += [
            HardCase(f"repeated_{label}", _scene(mesh, group),
                     "all singular values are equal: their vectors are arbitrary",
                     CALM, scales(1.3, 1.3, 1.3)),
            HardCase(f"nearly_repeated_{label}", _scene(mesh, group),
                     "singular values differ by round-off only", CALM,
                     noisy(scales(1.3, 1.3, 1.3), 1e-15)),
            HardCase(f"half_turn_{label}", _scene(mesh, group),
                     "the nearest rotation turns by pi: nothing may move",
                     (*CALM, "still"), turn),
        ]  # fmt: skip
    return cases


def _sizes() -> list[HardCase]:
    """Volumes and areas that are to be kept: states that leave the shape open."""
    lying = mapped((1, 0, 5), (0, 1, 0), (0, 0, 1))
    # what only keeps its size may be drawn out as long as its momentum carries it
    loose, cases = 40.0, []
    for label, mesh, group, flat in (
        ("volume", small_bar, VOLUME, scales(1, 1, 0)),
        ("area", sheet, AREA, scales(1, 1, 0)),
    ):
        cases += [
            HardCase(f"{label}_flat", _scene(mesh, group),
                     "every element has lost its size along one axis", CALM, flat, bound=loose),
            HardCase(f"{label}_point", _scene(mesh, group),
                     "all vertices in one point: no direction to grow in", CALM, scales(0, 0, 0),
                     bound=loose),
            HardCase(f"{label}_scrambled", _scene(mesh, group),
                     "vertices at random in a box: needles of the right size are near", CALM,
                     scrambled(), bound=loose),
            HardCase(f"{label}_swollen", _scene(mesh, group),
                     "three times as large along each axis: several shapes are near", CALM,
                     scales(3, 3, 3), bound=loose),
            HardCase(f"{label}_sheared", _scene(mesh, group),
                     "sheared five times over: nothing may move", (*CALM, "still"), lying),
        ]  # fmt: skip
    return [
        *cases,
        HardCase("volume_inverted", _scene(small_bar, VOLUME, frames=60),
                 "all tetrahedra are inverted: any axis may turn back", CALM, scales(1, 1, -1),
                 bound=loose),
        HardCase("volume_large_step", _scene(small_bar, VOLUME, _with(TETRAHEDRON, weight=1e5),
                                             GRAVITY, LEFT, time_step=0.1),
                 "a soft bar that keeps its volume, h = 0.1 s", FORCED, bound=4.0),
        HardCase("area_falling", _scene(sheet, AREA, _with(SPRING, weight=1e2), GRAVITY, FLOOR,
                                        LEFT),
                 "a soft sheet that keeps its area hangs and touches the floor", FORCED,
                 bound=4.0),
    ]  # fmt: skip


def _meshes() -> list[HardCase]:
    """Irregular meshes in regular scenes."""
    three = (BENDING, SPRING, STRAIN)
    return [
        HardCase("needles", _scene(lambda: scaled(sheet(wave=0.05), 1, 1e-4, 1e-4), *three, GRAVITY,
                                   LEFT),
                 "needle triangles, ten thousand times longer than wide", FORCED, bound=4.0),
        HardCase("slivers", _scene(lambda: scaled(small_bar(), 1, 1, 1e-6), TETRAHEDRON, GRAVITY,
                                   LEFT),
                 "every tetrahedron has quality 1e-6", FORCED, bound=4.0),
        HardCase("one_sliver", _scene(_one_bad_element, ROTATION, GRAVITY, LEFT),
                 "one sliver among regular tetrahedra", FORCED),
        HardCase("one_triangle", _scene(one_triangle, SPRING, STRAIN), "a mesh of one element",
                 CALM, scales(1.5, 0.5, 1)),
        HardCase("one_tetrahedron", _scene(one_tetrahedron, TETRAHEDRON, frames=60),
                 "a mesh of one element, inverted", (*CALM, "recovers"), scales(1, 1, -1)),
        HardCase("two_components", _scene(_two_sheets, SPRING, GRAVITY, FLOOR, LEFT),
                 "two sheets without a connection, one held and one free", FORCED, bound=3.0),
        HardCase("tiny_extent", _scene(lambda: scaled(small_bar(), 1e-6), ROTATION,
                                       vertex_mass=1e-12),
                 "a bar of a micrometre", CALM, scales(1.2, 1.2, 0)),
        HardCase("huge_extent", _scene(lambda: scaled(small_bar(), 1e6), ROTATION),
                 "a bar of a thousand kilometres", CALM, scales(1.2, 1.2, 0)),
        HardCase("far_away", _scene(lambda: shifted(sheet(), 1e9, 0, 0), SPRING, GRAVITY),
                 "a sheet a billion extents from the origin: edges cancel to seven digits",
                 FORCED),
        HardCase("flat_bending", _scene(sheet, BENDING, GRAVITY),
                 "the group does nothing: a flat sheet has no curvature to keep", FREE),
    ]  # fmt: skip


def _settings() -> list[HardCase]:
    """Extreme weights, masses, steps, forces."""
    held = (GRAVITY, LEFT)
    return [
        HardCase("stiffness_ratio", _scene(partial(sheet, wave=0.05), _with(BENDING, weight=1e-4),
                                           _with(SPRING, weight=1e8), _with(STRAIN, weight=1e-4),
                                           *held),
                 "stiffness of the groups differs by twelve decades", FORCED),
        HardCase("stiffest", _scene(sheet, _with(SPRING, weight=1e16), LEFT, time_step=1.0),
                 "stiffness at its limit, held: masses are round-off, pins are not", FORCED,
                 scales(1.1, 1, 1)),
        HardCase("stiffest_free", _scene(sheet, _with(SPRING, weight=1e16), time_step=1.0),
                 "stiffness at its limit, free: a translation of the body is round-off",
                 ("refused",), scales(1.1, 1, 1)),
        HardCase("softest", _scene(sheet, _with(SPRING, weight=1e-300), GRAVITY),
                 "forces far below round-off", FREE),
        HardCase("denormal_weight", _scene(sheet, _with(SPRING, weight=1e-320), GRAVITY),
                 "a weight below the normal range of numbers", FREE),
        HardCase("light", _scene(sheet, SPRING, vertex_mass=1e-12),
                 "masses are round-off beside the stiffness", ("refused",), scales(1.1, 1, 1)),
        HardCase("light_held", _scene(sheet, SPRING, *held, vertex_mass=1e-100),
                 "masses of nothing, held", FORCED, scales(1.1, 1, 1)),
        HardCase("overdamped", _scene(sheet, SPRING, {"effect": "damping", "rate": 1e3}),
                 "the explicit drag turns velocities round and enlarges them", ("refused",)),
        HardCase("mass_ratio", _scene(sheet, SPRING, STRAIN, *held, masses=_heavy_and_light),
                 "masses over eight decades, held", FORCED, bound=4.0),
        HardCase("mass_ratio_free", _scene(small_bar, TETRAHEDRON, masses=_heavy_and_light),
                 "masses over eight decades, free", CALM, scales(1.3, 0.7, -1)),
        HardCase("smallest_step", _scene(sheet, SPRING, *held, time_step=1e-5),
                 "h = 1e-5 s: inertia is everything", FORCED),
        HardCase("small_step", _scene(small_bar, ROTATION, *held, time_step=1e-3),
                 "h = 1e-3 s: K = 10 is more than it needs", FORCED),
        HardCase("large_step", _scene(small_bar, TETRAHEDRON, *held, time_step=0.1),
                 "h = 0.1 s: the bar falls a tenth of its extent in a frame", FORCED),
        HardCase("largest_step", _scene(sheet, SPRING, *held, time_step=1.0),
                 "h = 1 s: the sheet falls five extents in a frame", FORCED, bound=4.0),
        HardCase("one_iteration", _scene(sheet, STRAIN, *held, iterations=1),
                 "K = 1: the local and the global step never agree", FORCED),
        HardCase("one_iteration_inverted", _scene(small_bar, ROTATION, iterations=1, frames=60),
                 "K = 1 and all tetrahedra inverted", (*CALM, "recovers"), scales(1, 1, -1)),
        HardCase("heavy_gravity", _scene(sheet, SPRING, FLOOR, LEFT,
                                         {"effect": "gravity", "acceleration": [0, -9810, 0]}),
                 "gravity a thousand times the earth's", FORCED, bound=20.0),
        HardCase("long_run", _scene(sheet, SPRING, *held, frames=2000),
                 "two thousand frames", FORCED, slow=True),
        HardCase("long_free", _scene(small_bar, TETRAHEDRON, frames=2000),
                 "two thousand frames from an uneven stretch", CALM, scales(1.4, 0.8, -0.9),
                 slow=True),
    ]  # fmt: skip


def _boundaries() -> list[HardCase]:
    """Pins, handles, floor."""
    tear = {"effect": "translate", "select": "right", "offset": [100, 0, 0], "over": 1, "until": 10}
    twist = {"effect": "rotate", "select": "right", "axis": "x", "degrees": 180, "over": 1}
    again = {"effect": "translate", "select": "left", "offset": [1, 0, 0], "over": 5}
    return [
        HardCase("contradiction", _scene(sheet, SPRING, LEFT, again),
                 "pins and a handle want the same vertices in different places", ("refused",)),
        HardCase("torn", _scene(sheet, SPRING, LEFT, tear),
                 "a handle moves a hundred extents in one frame, and lets go", FORCED),
        HardCase("snapped", _scene(small_bar, ROTATION, LEFT, twist),
                 "a handle turns the end by pi in one frame", FORCED),
        HardCase("one_free_vertex", _scene(sheet, SPRING, GRAVITY, _all_but(14)),
                 "every vertex but one is held", FORCED),
        HardCase("nothing_free", _scene(sheet, SPRING, GRAVITY, _all_but()),
                 "every vertex is held: there is no system to solve", (*FORCED, "still")),
        HardCase("floor_at_speed", _scene(small_bar, TETRAHEDRON, GRAVITY, FLOOR),
                 "the floor is hit at ten kilometres a second", FORCED, falling(1e4),
                 bound=20.0),
        HardCase("below_floor", _scene(sheet, SPRING, GRAVITY, FLOOR),
                 "the start lies below the floor", FORCED, lowered(-5.0)),
        HardCase("kicked", _scene(sheet, STRAIN, {"effect": "kick", "speed": 1e3, "seed": 1}),
                 "a kick of a kilometre a second", FREE, bound=100.0),
    ]  # fmt: skip


def _air() -> list[HardCase]:
    """Drag and wind."""
    storm = {"effect": "wind", "velocity": [3e3, 9e3, 3e3]}
    return [
        HardCase("storm", _scene(sheet, SPRING, GRAVITY, LEFT, storm),
                 "wind of ten thousand metres a second, held on one side", FORCED, bound=20.0),
        HardCase("storm_light", _scene(partial(sheet, wave=0.05), STRAIN, storm, vertex_mass=1e-2,
                                       frames=10),
                 "the same wind takes a light sheet away in one frame", FORCED, bound=20.0),
        HardCase("syrup", _scene(small_bar, TETRAHEDRON, GRAVITY,
                                 {"effect": "drag", "coefficient": 1e12}),
                 "drag that stops the surface in far less than a frame", FORCED, scales(1.2, 1, 1)),
    ]  # fmt: skip


def _obstacles() -> list[HardCase]:
    """Cases: edges, tunnelling, starts inside an obstacle, zero and infinite friction."""
    ball = {"effect": "sphere", "centre": [0, 1, 0], "radius": 0.4}
    edge = {"effect": "box", "lower": [-0.02, 1.0, -2], "upper": [0.03, 1.9, 2], "friction": 0.5}
    plate = {"effect": "box", "lower": [-9, 1, -9], "upper": [9, 1, 9]}
    around = {"effect": "box", "lower": [-2, 0, -2], "upper": [2, 4, 2]}
    slope = {"effect": "plane", "point": [0, 1.8, 0], "normal": [0.6, 0.8, 0]}
    wire = {"effect": "box", "lower": [-9, 1.9, 0.03], "upper": [9, 1.9, 0.03], "friction": 1.0}
    fast, sticky = falling(1e4), {"friction": float("inf")}
    return [
        HardCase("box_edge", _scene(sheet, SPRING, GRAVITY, edge),
                 "a sheet falls on the edges of a box narrower than its cells", FORCED),
        HardCase("sphere_at_speed", _scene(small_bar, TETRAHEDRON, GRAVITY, ball, time_step=0.1),
                 "every vertex would pass the ball in one frame", FORCED, fast, bound=4e3),
        HardCase("plate_at_speed", _scene(sheet, SPRING, GRAVITY, plate),
                 "a plate without thickness is hit at ten kilometres a second", FORCED, fast,
                 bound=20.0),
        HardCase("inside_sphere", _scene(sheet, SPRING, _with(ball, centre=[0, 2, 0], radius=0.9)),
                 "all vertices start inside the ball, some at its centre", FORCED, bound=4.0),
        HardCase("inside_box", _scene(small_bar, TETRAHEDRON, around),
                 "all vertices start inside the box", FORCED, bound=10.0),
        HardCase("frictionless", _scene(sheet, SPRING, GRAVITY, slope),
                 "a slope without friction", FORCED),
        HardCase("sticky", _scene(sheet, SPRING, GRAVITY, {**slope, **sticky}),
                 "a slope with infinite friction", FORCED),
        HardCase("keys_at_speed", _scene(sheet, STRAIN, LEFT, {
                     "effect": "keyframes", "select": "right", "until": 10, "keys": [
                         {"at": 1, "offset": [0, 50, 0], "turn": [720, 0, 180]},
                         {"at": 2, "offset": [0, -50, 0]}]}),
                 "a handle jumps a hundred extents to and fro, turns over, and lets go", FORCED),
        HardCase("wire", _scene(sheet, SPRING, GRAVITY, wire),
                 "a box without width and height, thinner than any cell", FORCED),
        HardCase("ball_large_step", _scene(sheet, SPRING, GRAVITY, {
                     "effect": "sphere", "centre": [0, 0, 0], "radius": 0.1, **sticky},
                     time_step=1.0),
                 "h = 1 s: the sheet falls past a small sticky ball in one frame", FORCED,
                 bound=20.0),
        HardCase("below_slope", _scene(small_bar, TETRAHEDRON, GRAVITY, {
                     **slope, **sticky, "point": [0, 9, 0]}),
                 "all vertices start far behind a sticky slope", FORCED, bound=4.0),
        HardCase("slope_at_speed", _scene(sheet, STRAIN, GRAVITY, {**slope, **sticky},
                                          time_step=0.1),
                 "a sticky slope is passed by a thousand extents in one frame", FORCED, fast,
                 bound=20.0),
        HardCase("vice", _scene(small_bar, VOLUME, _with(TETRAHEDRON, weight=1e5), GRAVITY,
                                _with(plate, lower=[-9, 0, -9], upper=[9, 2.1, 9]),
                                _with(plate, lower=[-9, 1.9, -9], upper=[9, 4, 9])),
                 "two plates that overlap: whatever leaves one is inside the other", FORCED,
                 bound=20.0),
    ]  # fmt: skip


def _unstructured() -> list[HardCase]:
    """Meshes that are no grids: no two elements are alike, none lies along an axis."""
    ring, skin, starfish, torus = (
        partial(read_mesh_file, config_file(f"scenes/meshes/{name}").resolve()) for name in MESHES
    )
    ball = {"effect": "sphere", "centre": [0, 1.6, 0.05], "radius": 0.3, "friction": 0.5}
    edge = {"effect": "box", "lower": [-0.02, 1.0, -2], "upper": [0.03, 1.7, 2], "friction": 0.5}
    storm = {"effect": "wind", "velocity": [3e3, 9e3, 3e3]}
    three = {"effect": "pins", "select": {"kind": "nearest", "point": [0, 2, 0], "count": 3}}
    return [
        HardCase("torus_inverted", _scene(torus, ROTATION, frames=60),
                 "all tetrahedra of a torus are inverted", CALM, scales(1, 1, -1)),
        HardCase("starfish_flat", _scene(starfish, TETRAHEDRON),
                 "all tetrahedra of a starfish are flattened", CALM, scales(1, 0, 1)),
        HardCase("starfish_swollen", _scene(starfish, VOLUME, _with(TETRAHEDRON, weight=1e5)),
                 "a starfish three times as large along each axis", CALM, scales(3, 3, 3)),
        HardCase("disc_crumpled", _scene(ring, STRAIN, BENDING),
                 "a disc with a hole, crumpled into a third of its size", CALM, scrambled(0.3)),
        HardCase("disc_on_ball", _scene(ring, SPRING, GRAVITY, ball),
                 "a disc falls on a ball as wide as its hole, beside the middle", FORCED),
        HardCase("torus_on_edge", _scene(torus, TETRAHEDRON, GRAVITY, edge),
                 "a torus falls on the edges of a box narrower than its elements", FORCED),
        HardCase("shell_storm", _scene(skin, SPRING, BENDING, GRAVITY, storm, three),
                 "wind of ten thousand metres a second on a closed surface", FORCED, bound=20.0),
    ]  # fmt: skip


def _collisions() -> list[HardCase]:
    """Cases: bodies that collide with themselves."""
    apart = {"effect": "self_collision", "thickness": 0.18}
    return [
        HardCase("collision_folded", _scene(sheet, SPRING, GRAVITY, FLOOR, apart),
                 "vertices of different layers coincide, and fall as a heap", FORCED, folded),
        HardCase("collision_point", _scene(small_bar, TETRAHEDRON, _with(apart, thickness=0.3)),
                 "all vertices in one point, none of which may stay there", FORCED, scales(0, 0, 0),
                 bound=4.0),
        HardCase("collision_thick", _scene(sheet, SPRING, _with(apart, thickness=0.9)),
                 "a thickness as large as the sheet, crumpled", FORCED, scrambled(0.1),
                 bound=4.0),
        HardCase("collision_at_speed", _scene(_two_layers, SPRING, apart),
                 "two layers pass through each other in a tenth of a frame", FORCED, meeting(1e4),
                 bound=1e4),
        HardCase("collision_zero", _scene(sheet, SPRING, _with(apart, thickness=0.0)),
                 "a thickness of zero", ("refused",)),
    ]  # fmt: skip


PARTS = (
    _squashed, _states, _sizes, _meshes, _settings, _boundaries, _air, _obstacles, _collisions,
    _unstructured,
)  # fmt: skip
CASES: dict[str, HardCase] = {case.name: case for part in PARTS for case in part()}


def reducible_cases(slow: bool = False) -> list[str]:
    """Names of the (``slow``) cases that a reduction can repeat: those that are not refused."""
    return [name for name, c in CASES.items() if c.slow == slow and c.holds != ("refused",)]


def modules_of(names: Iterable[str]) -> list[str]:
    """Places of the effects of cases ``names`` (for the code fingerprint), "module:attribute"."""
    effects = {effect["effect"] for name in names for effect in CASES[name].scene.effects}
    return sorted(EFFECTS[effect] for effect in effects)
