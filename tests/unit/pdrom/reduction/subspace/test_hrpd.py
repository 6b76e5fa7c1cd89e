"""The smooth space of projections of hyper-reduced projective dynamics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_subspace_run import GRAVITY, SPRING, hrpd_of, whole_space

from builders import GROUPS, LEFT, TOP, make_scene, random_rotation
from pdrom.core.errors import SamplingError
from pdrom.model.runs import trajectory
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.subspace import hrpd
from pdrom.reduction.subspace.columns import skinning_weights
from pdrom.reduction.subspace.interpolation import (
    InterpolatedLocalStep,
    SubspaceLocalStep,
    interpolation_of,
)
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, rerun_model
from pdrom.reduction.subspace.space import coordinates


def test_centres_are_the_mean_of_the_elements_vertices(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    centres, p = hrpd.element_centres(group, points), group.rows_per_element
    dense = group.S.toarray().reshape(group.elements, p, -1)
    for e in (0, group.elements // 2, group.elements - 1):
        own = np.flatnonzero((dense[e] != 0.0).any(axis=0))
        np.testing.assert_allclose(centres[e], points[own].mean(axis=0), atol=1e-14)


def test_space_is_orthonormal_in_the_weights_and_starts_with_the_rest_vectors(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    space = hrpd.sampled_space(group, points, hrpd.HrpdSpec(dimension=10, samples=40))
    V = space.V
    assert V.shape[1] == 10
    np.testing.assert_allclose(V.T @ (group.row_weights[:, None] * V), np.eye(10), atol=1e-10)
    rest = group.S @ points
    first = V[:, :3] @ (V[:, :3].T @ (group.row_weights[:, None] * rest))
    np.testing.assert_allclose(first, rest, atol=1e-10 * np.abs(rest).max())


@pytest.mark.parametrize("name", sorted(GROUPS))
@settings(max_examples=10)
@given(seed=st.integers(0, 2**31), handles=st.integers(2, 4))
def test_blended_linear_maps_are_reproduced_exactly(name, seed, handles):
    """p_e = sum_h w_h(e) (S_e q_rest) T_h is in the space, and few samples find it."""
    scene = make_scene({"effect": name, "weight": 1e4}, mesh=GROUPS[name])
    group, points, rng = scene.groups[0], scene.mesh.points, np.random.default_rng(seed)
    rest = group.S @ points
    blend = skinning_weights(hrpd.element_centres(group, points), handles)
    maps = rng.standard_normal((handles, 3, 3))
    field = np.einsum("eh,epi,hij->epj", blend, rest.reshape(group.elements, -1, 3), maps)
    field = field.reshape(-1, 3)
    active = int(np.linalg.matrix_rank(rest))
    spec = hrpd.HrpdSpec(dimension=active * handles, samples=20)
    space = hrpd.sampled_space(group, points, spec)
    p = group.rows_per_element
    rows = (space.elements[:, None] * p + np.arange(p)).ravel()
    assert len(space.elements) < group.elements or group.elements <= 20
    again = space.V @ (space.operator @ field[rows])
    np.testing.assert_allclose(again, field, atol=1e-7 * np.abs(field).max())


def test_fit_is_weighted_least_squares(group_scene, rng):
    group, points = group_scene.groups[0], group_scene.mesh.points
    space = hrpd.sampled_space(group, points, hrpd.HrpdSpec(dimension=6, samples=12))
    p = group.rows_per_element
    rows = (space.elements[:, None] * p + np.arange(p)).ravel()
    values = rng.standard_normal((len(rows), 3))
    weights = group.row_weights[rows]
    left = values - space.V[rows] @ (space.operator @ values)
    scale = np.abs(space.V[rows].T @ (weights[:, None] * values)).max()
    assert np.abs(space.V[rows].T @ (weights[:, None] * left)).max() < 1e-9 * scale


def test_samples_spread_over_the_mesh():
    """Farthest points: with twice as many, none is farther from a sample than before."""
    scene = make_scene({"effect": "strain", "weight": 1.0})
    group, points = scene.groups[0], scene.mesh.points
    centres = hrpd.element_centres(group, points)

    def radius(samples: int) -> float:
        chosen = hrpd.sampled_space(
            group, points, hrpd.HrpdSpec(dimension=2, samples=samples)
        ).elements
        return float(np.linalg.norm(centres[:, None] - centres[chosen], axis=2).min(axis=1).max())

    assert radius(20) < 0.7 * radius(5)
    assert radius(10_000) == 0.0


def test_too_few_samples_are_a_named_error(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    words = f"'{group.name}': 2 samples .* allowed are more samples or a smaller dimension"
    with pytest.raises(SamplingError, match=words):
        hrpd.sampled_space(group, points, hrpd.HrpdSpec(dimension=12, samples=2))


def test_a_group_without_rest_vectors_has_no_space():
    scene = make_scene({"effect": "bending", "weight": 1.0})
    assert hrpd.sampled_space(scene.groups[0], scene.mesh.points, hrpd.HrpdSpec()) is None


R = 4
HRPD = hrpd.HrpdSpec(dimension=8, samples=20)


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


def test_hrpd_with_all_elements_and_dimensions_is_the_full_projection(group_scene, rng):
    scene, group = group_scene, group_scene.groups[0]
    spec = hrpd.HrpdSpec(dimension=group.elements * group.rows_per_element, samples=group.elements)
    space = hrpd.sampled_space(group, scene.mesh.points, spec)
    assert space.V.shape[1] == spec.dimension
    columns = whole_space(scene)
    y = scene.mesh.points + 0.1 * rng.standard_normal(scene.mesh.points.shape)
    found = hrpd.hrpd(group, columns, space)
    one, two = right_hand_sides(scene, columns, found, scene.mesh.points, y)
    np.testing.assert_allclose(one, two, atol=1e-8 * np.abs(two).max())


def test_hrpd_is_exact_for_the_rest_shape_in_every_orientation(group_scene, rng):
    """One linear map for all elements is in the space, whatever its dimension and samples."""
    scene, group = group_scene, group_scene.groups[0]
    columns = make_columns(scene, scene.mesh.points[None], "skinning", 3)
    found = hrpd.hrpd(group, columns, hrpd.sampled_space(group, scene.mesh.points, HRPD))
    assert len(found.elements) == min(HRPD.samples, group.elements)
    y = scene.mesh.points @ random_rotation(rng).T + rng.standard_normal(3)
    one, two = right_hand_sides(scene, columns, found, y, y)
    assert np.abs(two).max() > 0.0
    np.testing.assert_allclose(one, two, atol=1e-9 * np.abs(two).max())


def test_projections_that_are_round_off_need_no_element():
    """A flat sheet has nothing to bend: no mode, no sample, and the same run as with all."""
    scene = make_scene({"effect": "bending", "weight": 10.0}, SPRING, GRAVITY, TOP, frames=5)
    reference = trajectory(scene)
    columns = make_columns(scene, reference[1:], "pod", 3)
    found = hrpd_of(scene, columns)
    assert len(found["bending"].elements) == 0
    one, two = (
        rerun_model(scene, SubspaceModel("pod", columns, kept), reference).positions
        for kept in ({"bending": found["bending"]}, {})
    )
    np.testing.assert_allclose(one, two, atol=1e-9)


@pytest.mark.parametrize(
    "choices",
    [
        {"rows": "joint", "centring": "none", "solve": "square"},
        {"rows": "element", "centring": "affine"},
    ],
    ids=["joint rows", "whole elements"],
)
def test_the_right_hand_side_by_a_reduction_is_that_of_its_reconstruction(choices):
    effects = {"effect": "gravity"}, LEFT, {"effect": "strain", "weight": 1e4}
    scene = make_scene(*effects, mesh=GROUPS["strain"])
    (group,) = scene.groups
    run = trajectory(scene, track_objective=False)
    snapshots = np.stack([group.project(q) for q in run])
    spec = MethodSpec(title="x", **choices)
    basis = compute_basis(snapshots, np.ones(len(group.row_weights)), 1e-12, 2, spec)
    reduction = Reduction(basis, select(basis, spec, R), spec, R)
    columns = make_columns(scene, run, "pod", 3)
    step = InterpolatedLocalStep(group, columns, interpolation_of(group, columns, reduction))
    z = np.random.default_rng(0).standard_normal((columns.B.shape[1], 3))
    rhs = np.zeros_like(z)
    step.accumulate(z, rhs)
    p = reduction.reconstruct(group.project(columns.B @ z)[None])[0]
    strain = group.S @ columns.B
    assert rhs == pytest.approx(strain.T @ (group.row_weights[:, None] * p), rel=1e-9, abs=1e-9)
