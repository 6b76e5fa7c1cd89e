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
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.reduction import element_rows
from pdrom.reduction.subspace import hrpd
from pdrom.reduction.subspace.columns import skinning_weights
from pdrom.reduction.subspace.interpolation import (
    InterpolatedLocalStep,
    SubspaceLocalStep,
    interpolation_of,
)
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import coordinates
from pdrom.reduction.subspace.training import make_columns


def test_the_space_is_orthonormal_starts_with_rest_vectors_and_fits_least_squares(group_scene, rng):
    """Products use the weights of the elements; a space with too few samples is a named error.

    Elements are chosen by their centres, which are the means of their vertices.
    """
    group, points = group_scene.groups[0], group_scene.mesh.points
    centres = hrpd.element_centres(group, points)
    touched = (group.S.toarray().reshape(group.elements, -1, len(points)) != 0.0).any(axis=1)
    np.testing.assert_allclose(centres, [points[own].mean(axis=0) for own in touched], atol=1e-14)
    space = hrpd.sampled_space(group, points, hrpd.HrpdSpec(dimension=10, samples=40))
    V = space.V
    assert V.shape[1] == 10
    np.testing.assert_allclose(V.T @ (group.row_weights[:, None] * V), np.eye(10), atol=1e-10)
    rest = group.S @ points
    first = V[:, :3] @ (V[:, :3].T @ (group.row_weights[:, None] * rest))
    np.testing.assert_allclose(first, rest, atol=1e-10 * np.abs(rest).max())
    rows = element_rows(space.elements, group.rows_per_element)
    values = rng.standard_normal((len(rows), 3))
    weighted = group.row_weights[rows, None] * V[rows]
    left = values - V[rows] @ (space.operator @ values)
    assert np.abs(weighted.T @ left).max() < 1e-9 * np.abs(weighted.T @ values).max()
    words = f"'{group.name}': 2 samples .* allowed are more samples or a smaller dimension"
    with pytest.raises(SamplingError, match=words):
        hrpd.sampled_space(group, points, hrpd.HrpdSpec(dimension=12, samples=2))


@pytest.mark.parametrize("name", sorted(GROUPS))
@settings(max_examples=10)
@given(seed=st.integers(0, 2**31), handles=st.integers(2, 4))
def test_blended_linear_maps_are_reproduced_exactly(name, seed, handles):
    """p_e = sum_h w_h(e) (S_e q_rest) T_h is in the space, and few samples reproduce it."""
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
    assert len(space.elements) < group.elements or group.elements <= 20
    rows = element_rows(space.elements, group.rows_per_element)
    again = space.V @ (space.operator @ field[rows])
    np.testing.assert_allclose(again, field, atol=1e-7 * np.abs(field).max())


def test_hrpd_is_exact_with_all_elements_and_for_a_rotated_rest_shape(group_scene, rng):
    """One linear map for all elements is in the space, for any dimension and samples."""
    scene, group, rest = group_scene, group_scene.groups[0], group_scene.mesh.points
    size = group.elements * group.rows_per_element
    turned = rest @ random_rotation(rng).T + rng.standard_normal(3)
    bent = rest + 0.1 * rng.standard_normal(rest.shape)
    few = make_columns([scene], rest[None], skinning=3)
    for dimension, samples, columns, q, y in (
        (size, group.elements, whole_space(scene), rest, bent),
        (8, 20, few, turned, turned),
    ):
        spec = hrpd.HrpdSpec(dimension=dimension, samples=samples)
        space = hrpd.sampled_space(group, rest, spec)
        assert space.V.shape[1] == dimension
        found = hrpd.hrpd(group, columns, space)
        assert len(found.elements) == min(samples, group.elements)
        steps = InterpolatedLocalStep(group, columns, found), SubspaceLocalStep(group, columns)
        sums = np.zeros((2, columns.B.shape[1], 3))
        for step, rhs in zip(steps, sums, strict=True):
            step.begin_frame(coordinates(columns, scene.masses, q))
            step.accumulate(coordinates(columns, scene.masses, y), rhs)
        assert np.abs(sums[1]).max() > 0.0
        np.testing.assert_allclose(*sums, atol=1e-8 * np.abs(sums[1]).max())


def test_projections_of_rounding_errors_need_no_element():
    """A flat sheet does not bend: no mode, no sample, and the same run as with all elements."""
    scene = make_scene({"effect": "bending", "weight": 10.0}, SPRING, GRAVITY, TOP, frames=5)
    reference = trajectory(scene)
    columns = make_columns([scene], reference[1:], 3)
    found = hrpd_of(scene, columns)
    assert len(found["bending"].elements) == 0
    one, two = (
        Yardstick(scene, reference).run(SubspaceModel(columns, kept)).positions
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
    reduction = Reduction(basis, select(basis, spec, 4), spec, 4)
    columns = make_columns([scene], run, 3)
    step = InterpolatedLocalStep(group, columns, interpolation_of(group, columns, reduction))
    z = np.random.default_rng(0).standard_normal((columns.B.shape[1], 3))
    rhs = np.zeros_like(z)
    step.accumulate(z, rhs)
    p = reduction.reconstruct(group.project(columns.B @ z)[None])[0]
    strain = group.S @ columns.B
    assert rhs == pytest.approx(strain.T @ (group.row_weights[:, None] * p), rel=1e-9, abs=1e-9)
