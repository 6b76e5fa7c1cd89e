"""Interpolated projections: exact where nothing is lost, and no longer online than the sample."""

import numpy as np
import pytest
from meshless import assert_reads_nothing_of_the_mesh
from test_subspace_run import GRAVITY, PINS, SCENES, SPRING, run_model, whole_space

from builders import GROUPS, make_scene, random_rotation
from pdrom.core.store import open_hdf5, write_hdf5
from pdrom.model.constraints.lanes import LANES
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.subspace.block_deim import block_deim, train_basis
from pdrom.reduction.subspace.hrpd import hrpd, sampled_space
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.interpolation import InterpolatedLocalStep, Interpolation
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.space import coordinates
from pdrom.reduction.subspace.specs import HrpdSpec, InterpolationSpec

FEW = {"kind": "bar", "nx": 3, "ny": 2, "nz": 2}
EVERYTHING = {"modes": 10_000, "oversampling": 100}
GAPPY = InterpolationSpec(modes=8, states="visited", oversampling=3, margin=0.1)
HRPD = HrpdSpec(dimension=8, samples=20)


def right_hand_sides(scene, columns, interpolation, q, y):
    """Of the interpolated and of the full projections, both (K, 3), at coordinates of q and y."""
    group = scene.groups[0]
    found = []
    for step in (
        InterpolatedLocalStep(group, columns, interpolation),
        SubspaceLocalStep(group, columns),
    ):
        rhs = np.zeros((columns.B.shape[1], 3))
        step.begin_frame(coordinates(columns, scene.masses, q))
        step.accumulate(coordinates(columns, scene.masses, y), rhs)
        found.append(rhs)
    return found


def interpolations_of(scene, columns, training, method):
    if method == "hrpd":
        return {
            g.name: hrpd(g, columns, sampled_space(g, scene.mesh.points, HRPD))
            for g in scene.groups
        }
    return interpolate(scene, columns, Training(scene, columns, training), GAPPY)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"centring": "affine"},
        {"interpolates": "residual"},
        {"test": "interpolated"},
        {"interpolates": "both"},
        {"interpolates": "both", "test": "interpolated"},
    ],
    ids=str,
)
@pytest.mark.parametrize("name", GROUPS)
def test_the_whole_space_from_all_elements_is_the_full_projection(name, rng, changes):
    """Random states in number enough span every projection; nothing is left to interpolate.

    The bar has few elements: the basis is as large as all projections together.
    """
    mesh = GROUPS[name] if GROUPS[name]["kind"] == "cloth" else FEW
    scene = make_scene({"effect": name, "weight": 1e4}, mesh=mesh)
    (group,) = scene.groups
    points = scene.mesh.points
    count = 3 * group.elements * group.rows_per_element + 5
    states = [(points, points + rng.standard_normal(points.shape)) for _ in range(count)]
    spec = InterpolationSpec(**EVERYTHING, **changes)
    columns = whole_space(scene)
    found = block_deim(group, columns, train_basis(group, states, spec), spec)
    assert len(found.elements) == group.elements
    assert found.gain == pytest.approx(1.0, abs=1e-9)
    y = points + 0.1 * rng.standard_normal(points.shape)
    one, two = right_hand_sides(scene, columns, found, points, y)
    np.testing.assert_allclose(one, two, atol=1e-8 * np.abs(two).max())


def test_hrpd_with_all_elements_and_dimensions_is_the_full_projection(group_scene, rng):
    scene, group = group_scene, group_scene.groups[0]
    spec = HrpdSpec(dimension=group.elements * group.rows_per_element, samples=group.elements)
    space = sampled_space(group, scene.mesh.points, spec)
    assert space.V.shape[1] == spec.dimension
    columns = whole_space(scene)
    y = scene.mesh.points + 0.1 * rng.standard_normal(scene.mesh.points.shape)
    found = hrpd(group, columns, space)
    one, two = right_hand_sides(scene, columns, found, scene.mesh.points, y)
    np.testing.assert_allclose(one, two, atol=1e-8 * np.abs(two).max())


def test_hrpd_is_exact_for_the_rest_shape_in_every_orientation(group_scene, rng):
    """One linear map for all elements is in the space, whatever its dimension and samples."""
    scene, group = group_scene, group_scene.groups[0]
    columns = make_columns(scene, scene.mesh.points[None], "skinning", 3)
    found = hrpd(group, columns, sampled_space(group, scene.mesh.points, HRPD))
    assert len(found.elements) == min(HRPD.samples, group.elements)
    y = scene.mesh.points @ random_rotation(rng).T + rng.standard_normal(3)
    one, two = right_hand_sides(scene, columns, found, y, y)
    assert np.abs(two).max() > 0.0
    np.testing.assert_allclose(one, two, atol=1e-9 * np.abs(two).max())


def test_interpolation_is_linear_algebra_of_the_definition(group_scene, rng):
    """B^T S^T W (mean + V (P^T V)^+ P^T (p - mean)), with dense matrices."""
    scene, group = group_scene, group_scene.groups[0]
    points = scene.mesh.points
    states = [(points, points + 0.3 * rng.standard_normal(points.shape)) for _ in range(12)]
    spec = InterpolationSpec(modes=6, centring="affine", oversampling=2)
    basis = train_basis(group, states, spec)
    columns = make_columns(scene, points[None], "skinning", 4)
    found = block_deim(group, columns, basis, spec)
    y = columns.B @ rng.standard_normal((columns.B.shape[1], 3))
    group.begin_frame(points)
    p = group.project(y).ravel()
    size = 3 * group.rows_per_element
    entries = np.concatenate([np.arange(size * e, size * (e + 1)) for e in found.elements])
    V = basis.V[:, :6]
    fit = np.linalg.pinv(V[entries]) @ (p - basis.mean)[entries]
    reduced = (basis.mean + V @ fit).reshape(-1, 3)
    expected = (group.S.toarray() @ columns.B).T @ (group.row_weights[:, None] * reduced)
    one, _ = right_hand_sides(scene, columns, found, points, y)
    np.testing.assert_allclose(one, expected, atol=1e-9 * np.abs(expected).max())
    assert found.gain == pytest.approx(np.linalg.norm(np.linalg.pinv(V[entries]), 2), rel=1e-9)


def test_galerkin_tests_with_interpolated_strains(group_scene, rng):
    """The reduced right-hand side is T^T W V c, T the interpolated strains of every coordinate."""
    scene, group = group_scene, group_scene.groups[0]
    points = scene.mesh.points
    states = [(points, points + 0.3 * rng.standard_normal(points.shape)) for _ in range(12)]
    spec = InterpolationSpec(modes=5, oversampling=2, test="interpolated")
    basis = train_basis(group, states, spec)
    columns = make_columns(scene, points[None], "skinning", 2)
    found = block_deim(group, columns, basis, spec)
    V, size = basis.V[:, :5], 3 * group.rows_per_element
    entries = np.concatenate([np.arange(size * e, size * (e + 1)) for e in found.elements])
    strains = np.kron(group.S.toarray() @ columns.B, np.eye(3))
    tests = V @ found.operator @ strains[entries]
    expected = tests.T @ (np.repeat(group.row_weights, 3)[:, None] * V)
    np.testing.assert_allclose(found.modes, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("method", ["hrpd", "gappy"])
@pytest.mark.parametrize("kind", ["pod", "skinning"])
@pytest.mark.parametrize("name", ["pins", "handles", "bar"])
def test_pins_and_handles_are_met_exactly(name, kind, method):
    scene = SCENES[name]()
    reference = trajectory(scene)
    columns = make_columns(scene, reference[1:], kind, 3)
    found = interpolations_of(scene, columns, reference[1:], method)
    result = run_model(scene, SubspaceModel(kind, columns, found))
    assert np.isfinite(result).all()
    for boundary in scene.boundaries:
        held = boundary.held(0)
        np.testing.assert_allclose(result[1:, held], reference[1:, held], atol=1e-12)


@pytest.mark.parametrize("method", ["hrpd", "gappy"])
@pytest.mark.parametrize("name", ["handles", "bending", "bar", "poke", "damped"])
def test_a_step_reads_nothing_of_the_mesh(name, method):
    """With everything of the length of the mesh overwritten the second run is the same."""
    config = SCENES[name]().config
    effects = [e.model_dump() for e in config.effects]
    scene = make_scene(*effects, mesh=config.mesh.model_dump(), frames=config.frames)
    reference = trajectory(scene)
    columns = make_columns(scene, reference[1:], "pod", 3)
    found = interpolations_of(scene, columns, reference[1:], method)
    loop, start = SubspaceModel("pod", columns, found).loop(scene)
    assert_reads_nothing_of_the_mesh(scene, columns, loop, start)


def test_arrays_of_a_step_have_the_size_of_the_sample():
    """Meshes of two sizes: nothing that the step holds grows."""
    sizes = []
    for rows in (10, 20):
        scene = make_scene(SPRING, PINS, mesh={"kind": "cloth", "rows": rows, "columns": 10})
        run = trajectory(scene)
        columns = make_columns(scene, run[1:], "skinning", 4)
        found = hrpd(
            scene.groups[0],
            columns,
            sampled_space(scene.groups[0], scene.mesh.points, HrpdSpec(dimension=6, samples=8)),
        )
        step = InterpolatedLocalStep(scene.groups[0], columns, found)
        held = [v for v in vars(step).values() if isinstance(v, np.ndarray)]
        held += [v for v in vars(step.group).values() if isinstance(v, np.ndarray)]
        held += [v for v in vars(found).values() if isinstance(v, np.ndarray)]
        assert len(held) >= 9
        sizes.append(sum(a.size for a in held))
        # blocks are filled up
        numbers = 5
        assert max(a.shape[0] for a in held) <= max(2 * 8 * group_vertices(scene), numbers * LANES)
    # the sampled edges share another number of vertices, nothing else differs
    assert abs(sizes[1] - sizes[0]) <= 8 * columns.B.shape[1]


def group_vertices(scene) -> int:
    """Vertices of one element."""
    return int(np.diff(scene.groups[0].S.indptr).max())


def test_projections_that_are_round_off_need_no_element():
    """A flat sheet has nothing to bend: no mode, no sample, and the same run as with all."""
    scene = make_scene({"effect": "bending", "weight": 10.0}, SPRING, GRAVITY, PINS, frames=5)
    reference = trajectory(scene)
    columns = make_columns(scene, reference[1:], "pod", 3)
    for method in ("hrpd", "gappy"):
        found = interpolations_of(scene, columns, reference[1:], method)
        assert len(found["bending"].elements) == 0
        kept = {"bending": found["bending"]}
        one = run_model(scene, SubspaceModel("pod", columns, kept))
        np.testing.assert_allclose(one, run_model(scene, SubspaceModel("pod", columns)), atol=1e-9)


def test_bounds_stop_coefficients_at_the_edge_of_the_training_range(rng):
    scene = SCENES["pins"]()
    group, points = scene.groups[0], scene.mesh.points
    states = [(points, points + 0.1 * rng.standard_normal(points.shape)) for _ in range(10)]
    columns = whole_space(scene)
    far = points + 50.0 * rng.standard_normal(points.shape)
    seen = {}
    for margin in (None, 0.0, 0.5):
        spec = InterpolationSpec(modes=4, margin=margin)
        found = block_deim(group, columns, train_basis(group, states, spec), spec)
        rhs = right_hand_sides(scene, columns, found, far, far)[0] - found.offset
        seen[margin] = np.linalg.lstsq(found.modes, rhs.ravel(), rcond=None)[0]
        if margin is not None:
            low, high = found.lower.ravel(), found.upper.ravel()
            assert (seen[margin] >= low - 1e-6).all()
            assert (seen[margin] <= high + 1e-6).all()
    assert np.abs(seen[None] - seen[0.0]).max() > 0.1
    np.testing.assert_allclose(seen[0.5].shape, (4,))


def test_interpolations_survive_a_file(tmp_path, rng):
    scene = SCENES["pins"]()
    reference = trajectory(scene)
    columns = make_columns(scene, reference[1:], "pod", 3)
    for method in ("hrpd", "gappy"):
        found = interpolations_of(scene, columns, reference[1:], method)["spring"]
        path = tmp_path / f"{method}.h5"
        with write_hdf5(path) as file:
            found.save(file.create_group("it"))
        with open_hdf5(path) as file:
            loaded = Interpolation.load(file["it"])
        for name, value in vars(found).items():
            if isinstance(value, np.ndarray):
                np.testing.assert_array_equal(getattr(loaded, name), value)
            else:
                assert getattr(loaded, name) == value


def test_both_sides_with_galerkin_are_a_symmetric_system(group_scene, rng):
    """What the iteration converges to has the matrix (T^T W T), symmetric and semi-definite."""
    scene, group = group_scene, group_scene.groups[0]
    points = scene.mesh.points
    states = [(points, points + 0.3 * rng.standard_normal(points.shape)) for _ in range(12)]
    spec = InterpolationSpec(modes=5, oversampling=2, interpolates="both", test="interpolated")
    columns = make_columns(scene, points[None], "skinning", 2)
    found = block_deim(group, columns, train_basis(group, states, spec), spec)
    size = 3 * group.rows_per_element
    entries = np.concatenate([np.arange(size * e, size * (e + 1)) for e in found.elements])
    strains = np.kron(group.S.toarray() @ columns.B, np.eye(3))
    matrix = found.modes @ found.operator @ strains[entries]
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-9 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix)[0] > -1e-9 * np.abs(matrix).max()
