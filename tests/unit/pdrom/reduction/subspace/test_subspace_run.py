"""Runs in a position subspace: exact if the basis is complete, independent of the mesh."""

from functools import partial

import numpy as np
import pytest
from scipy import optimize

from builders import GROUPS, LEFT, TOP, make_scene
from pdrom.core.errors import SceneError
from pdrom.core.store import write_hdf5
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.runs import trajectory
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.sampling.reduction import element_rows
from pdrom.reduction.subspace import model as models
from pdrom.reduction.subspace import training
from pdrom.reduction.subspace.columns import atoms, build_columns
from pdrom.reduction.subspace.fused import FusedStepper
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.space import ReducedSpace, coordinates

SPRING = {"effect": "spring", "weight": 1e5}
STRAIN = {"effect": "strain", "weight": 1e5}
GRAVITY = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}
HANDLES = (TOP, {"effect": "rotate", "select": "bottom", "axis": "y", "degrees": 30.0, "over": 6})
BOTTOM = {"effect": "pins", "select": "bottom"}
DAMPING = {"effect": "damping", "rate": 2.0}
DRAG = {"effect": "drag", "coefficient": 5.0}
BENDING = {"effect": "bending", "weight": 10.0}
TETRAHEDRA = {"effect": "tetrahedron_strain", "weight": 1e6}
BAR = GROUPS["tetrahedron_strain"]
POKE = {"effect": "poke", "over": 4, "rest": 2, "count": 2, "avoid": ["top"]}
DOWN = {"effect": "gravity", "acceleration": [0.0, -300.0, 0.0]}

# each test makes one: fixtures of a module stay in memory until the interpreter ends
SCENES = {
    "free": partial(make_scene, SPRING, STRAIN, GRAVITY, frames=6),
    "pins": partial(make_scene, SPRING, GRAVITY, TOP, frames=6),
    "handles": partial(make_scene, SPRING, STRAIN, GRAVITY, *HANDLES, frames=8),
    "released": partial(make_scene, SPRING, GRAVITY, TOP, {**BOTTOM, "until": 3}, frames=8),
    "damped": partial(make_scene, SPRING, GRAVITY, DAMPING, TOP, frames=6),
    "dragged": partial(make_scene, SPRING, GRAVITY, DAMPING, DRAG, TOP, frames=6),
    "bending": partial(make_scene, BENDING, GRAVITY, TOP, mesh=GROUPS["bending"], frames=6),
    "bar": partial(make_scene, TETRAHEDRA, GRAVITY, LEFT, mesh=BAR, frames=6),
    "poke": partial(make_scene, SPRING, POKE, TOP, frames=12),
    "floor": partial(make_scene, SPRING, DOWN, {"effect": "floor"}, frames=12),
}


def ecsw_of(scene, columns, every=5):
    """Every fifth element, with a weight of five."""
    taken = {g.name: np.arange(0, g.elements, every) for g in scene.groups}
    return {
        name: models.Samples(few, np.full(len(few), every * 1.0)) for name, few in taken.items()
    }


def hrpd_of(scene, columns):
    spec = HrpdSpec(dimension=8, samples=20)
    return {
        g.name: hrpd(g, columns, sampled_space(g, scene.mesh.points, spec)) for g in scene.groups
    }


def whole_space(scene):
    """Columns that span all positions of all vertices."""
    n = scene.mesh.vertices
    found = atoms(training.held_units([scene]), n)
    anything = np.random.default_rng(0).standard_normal((n, n, 3))
    columns = build_columns(np.eye(n), scene.mesh.points, scene.masses, found, anything)
    assert columns.B.shape == (n, n)
    return columns


@pytest.mark.parametrize("name", SCENES)
def test_a_subspace_of_all_positions_repeats_the_full_order_run(name):
    scene = SCENES[name]()
    reference = trajectory(scene)
    motion = np.linalg.norm(reference[-1] - reference[0])
    model = models.SubspaceModel(whole_space(scene))
    result = Yardstick(scene, reference).run(model).positions
    assert np.linalg.norm(result[-1] - reference[-1]) < 1e-8 * motion
    np.testing.assert_allclose(result, reference, atol=1e-7)


@pytest.mark.parametrize("made", [lambda *_: {}, hrpd_of], ids=["all", "hrpd"])
@pytest.mark.parametrize("kind", ["pod", "skinning"])
@pytest.mark.parametrize("name", ["pins", "handles", "released", "poke", "bar"])
def test_fixed_vertices_have_their_prescribed_positions_exactly(name, kind, made):
    scene = SCENES[name]()
    reference = trajectory(scene)
    columns = training.make_columns([scene], reference[1:], **{kind: 3})
    model = models.SubspaceModel(columns, made(scene, columns))
    result = Yardstick(scene, reference).run(model).positions
    assert np.isfinite(result).all()
    checked = 0
    for boundary in scene.boundaries:
        took_hold, last = 0, None
        for frame in range(scene.config.frames):
            if not boundary.active(frame):
                continue
            held = boundary.held(frame)
            if not np.array_equal(held, last):
                # a poked vertex starts at its current position in this run
                took_hold, last = frame, held
            moved, wanted = (r[frame + 1, held] - r[took_hold, held] for r in (result, reference))
            np.testing.assert_allclose(moved, wanted, atol=1e-12)
            checked += 1
    assert checked >= scene.config.frames


@pytest.mark.parametrize(("vertices", "columns"), [(3, 1), (512, 4), (1300, 7)])
def test_positions_in_single_precision_are_columns_times_coordinates(vertices, columns):
    rng = np.random.default_rng(1)
    B, z = rng.standard_normal((vertices, columns)), rng.standard_normal((columns, 3))
    np.testing.assert_allclose(models.Output(B)(z), B @ z, rtol=0.0, atol=1e-5)


def test_a_restricted_group_equals_the_full_group_on_its_elements(group_scene, rng):
    """Projections, energy and right-hand side are equal, also with the frozen data of a frame."""
    group, points = group_scene.groups[0].for_run(), group_scene.mesh.points
    elements = np.sort(rng.permutation(group.elements)[: group.elements // 3])
    factors = rng.uniform(0.5, 4.0, len(elements))
    part, vertices = group.restricted(elements, factors)
    q, y = points + 0.05 * rng.standard_normal((2, *points.shape))
    group.begin_frame(q)
    part.begin_frame(q[vertices])
    p = group.project_elements(y, elements)
    np.testing.assert_allclose(part.project(y[vertices]), p, rtol=1e-12, atol=1e-12)
    s = group.S.toarray()[element_rows(elements, group.rows_per_element)]
    weights = np.repeat(group.weights[elements] * factors, group.rows_per_element)
    rhs, expected = np.zeros((len(vertices), 3)), s.T @ (weights[:, None] * p)
    energy = part.accumulate(y[vertices], rhs)
    np.testing.assert_allclose(rhs, expected[vertices], rtol=1e-9, atol=1e-9)
    assert np.abs(expected).sum() == pytest.approx(np.abs(expected[vertices]).sum())
    assert energy == pytest.approx(0.5 * float(weights @ ((s @ y - p) ** 2).sum(axis=1)), rel=1e-9)
    part.begin_frame(10.0 * y[vertices][:, ::-1])
    part.weights[...] = np.nan
    np.testing.assert_array_equal(group.project_elements(y, elements), p)
    assert np.isfinite(group.weights).all()


@pytest.mark.parametrize("made", [ecsw_of, hrpd_of])
@pytest.mark.parametrize("name", ["handles", "bending", "bar", "poke", "damped"])
def test_a_reduced_step_reads_no_array_of_the_length_of_the_mesh(name, made):
    """After all arrays of the length of the mesh are overwritten, a second run is the same."""
    scene = SCENES[name]()
    columns = training.make_columns([scene], trajectory(scene)[1:], 3)
    loop, start = models.SubspaceModel(columns, made(scene, columns)).loop(scene)

    def run() -> np.ndarray:
        state, states = start, []
        for frame in range(scene.config.frames):
            state, _ = loop.step(state, frame)
            states.append(state.positions)
        return np.stack(states)

    before = run()
    assert np.isfinite(before).all()
    for array in (columns.B, scene.mesh.points, scene.masses):
        array.setflags(write=True)
        array[...] = np.nan
    for group in scene.groups:
        group.S.data[...] = np.nan
        group.weights[...] = np.nan
    np.testing.assert_array_equal(run(), before)


@pytest.mark.parametrize(
    "name", ["free", "handles", "released", "poke", "damped", "dragged", "bending", "bar"]
)
def test_iterations_in_compiled_code_equal_those_of_the_step_loop(name):
    """The step loop does projections and solve one after the other."""
    scene = SCENES[name]()
    reference = trajectory(scene)
    columns = training.make_columns([scene], reference[1:], 4)
    loop, state = models.SubspaceModel(columns, ecsw_of(scene, columns, 3)).loop(scene)
    assert isinstance(loop, FusedStepper)
    plain = Stepper(loop.space, loop.time_step, loop.iterations, loop.local_steps)
    other, frames = state, range(scene.config.frames)
    for frame, (many, _) in zip(frames, loop.run(state, frames), strict=True):
        state, report = loop.step(state, frame)
        other, _ = plain.step(other, frame)
        np.testing.assert_array_equal(many.positions, state.positions)
        np.testing.assert_array_equal(many.velocities, state.velocities)
        assert len(report.objective) == 0
        np.testing.assert_allclose(state.positions, other.positions, rtol=1e-8, atol=1e-8)
    moved = other.positions - coordinates(columns, scene.masses, scene.mesh.points)
    assert np.linalg.norm(moved) > 1e-3


@pytest.mark.parametrize("name", ["free", "handles", "bending", "bar"])
def test_newton_steps_reach_the_minimum_that_scipy_and_local_global_iterations_find(name):
    scene = SCENES[name]()
    columns = training.make_columns([scene], trajectory(scene)[1:], 6)
    model = models.SubspaceModel(columns, ecsw_of(scene, columns, 3))
    loop, state = model.loop(scene.iterated(200), newton=True)
    s, system, base, _ = loop._begin(state, 0)

    def evaluate(numbers):
        y, rhs = s.copy(), base.copy()
        y[system.free] = numbers.reshape(-1, 3)
        energy = sum(step.accumulate(y, rhs) for step in loop.local_steps)
        gradient = (loop.space.matrix @ y - rhs)[system.free]
        return energy + loop.space.inertia_energy(y - s), gradient.ravel()

    start, seen = s[system.free].ravel(), []
    wanted = optimize.minimize(evaluate, start, jac=True, options={"gtol": 1e-7}).x
    found = loop.step(state, 0, seen.append)[0].positions
    near = 2e-5 * scene.mesh.extent  # frames end at 1e-6 in the mean over all vertices
    np.testing.assert_allclose(found[system.free].ravel(), wanted, atol=near)
    limit = model.loop(scene.iterated(3000))[0].step(state, 0)[0].positions
    np.testing.assert_allclose(found, limit, atol=near)
    np.testing.assert_array_equal(found, seen[0])
    scene.groups[0].gradient_kernel = None
    with pytest.raises(SceneError, match="Newton's method needs sampled elements"):
        model.loop(scene, newton=True)


def test_newton_steps_never_raise_the_objective_of_a_stiff_bar():
    bar, stiff = {"kind": "bar", "nx": 5, "ny": 2, "nz": 2}, TETRAHEDRA | {"weight": 2e12}
    scene = make_scene(LEFT, GRAVITY, stiff, mesh=bar, masses=[{"density": 1000.0}])
    model = models.SubspaceModel(whole_space(scene))
    loop, state = model.loop(scene.iterated(9), newton=True)
    for frame in range(5):
        s, values = loop._begin(state, frame)[0], []
        for count in (20, 40, 90):
            y = model.loop(scene.iterated(count), newton=True)[0].step(state, frame)[0].positions
            energies = [step.accumulate(y, np.zeros_like(y)) for step in loop.local_steps]
            values.append(sum(energies) + loop.space.inertia_energy(y - s))
        assert values == sorted(values, reverse=True)
        state = loop.step(state, frame)[0]


def test_forces_that_cannot_be_reduced_are_refused():
    scene = make_scene(SPRING, GRAVITY)
    force = scene.forces[0]
    force.acceleration = lambda positions, velocities: velocities**2
    columns = training.make_columns([scene], np.stack([scene.mesh.points] * 2), skinning=2)
    with pytest.raises(SceneError, match="'gravity' is not affine in the velocity"):
        ReducedSpace(scene, columns, [np.eye(columns.B.shape[1])])


def test_models_are_read_as_they_were_written(tmp_path):
    """The file has the layout of the rule `subspaces`."""
    scene = SCENES["handles"]()
    reference = trajectory(scene)
    columns = training.make_columns([scene], reference[1:], 4)
    samples = training.sampled_models([scene], columns, np.arange(8), [1e-2])[0].samples
    written = {"full": {}, "ecsw": samples, "hrpd": hrpd_of(scene, columns)}
    with write_hdf5(tmp_path / "models.h5") as file:
        models.store_columns(file.create_group("columns/pod_k004"), columns)
        for method, chosen in written.items():
            labels = {"method": method, "position_basis": "pod", "k": 4, "base": "pod_k004"}
            models.store_model(file.create_group(f"models/pod_k004_{method}"), labels, chosen)
    loaded = models.load_models(tmp_path / "models.h5")
    assert [labels for labels, _ in loaded] == [
        {"method": method, "position_basis": "pod", "k": 4} for method in written
    ]
    for labels, model in loaded:
        chosen = written[labels["method"]]
        assert model.samples.keys() == chosen.keys()
        pairs = [(columns, model.columns), *((chosen[n], model.samples[n]) for n in chosen)]
        for own, read in pairs:
            assert type(read) is type(own)
            np.testing.assert_equal(vars(read), vars(own))
