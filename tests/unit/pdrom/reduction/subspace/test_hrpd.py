"""The smooth space of projections of hyper-reduced projective dynamics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builders import GROUPS, make_scene
from pdrom.core.errors import SamplingError
from pdrom.reduction.subspace.columns import skinning_weights
from pdrom.reduction.subspace.hrpd import (
    HrpdSpec,
    SampledSpace,
    element_centres,
    sampled_space,
)


def test_centres_are_the_mean_of_the_elements_vertices(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    centres, p = element_centres(group, points), group.rows_per_element
    dense = group.S.toarray().reshape(group.elements, p, -1)
    for e in (0, group.elements // 2, group.elements - 1):
        own = np.flatnonzero((dense[e] != 0.0).any(axis=0))
        np.testing.assert_allclose(centres[e], points[own].mean(axis=0), atol=1e-14)


def test_space_is_orthonormal_in_the_weights_and_starts_with_the_rest_vectors(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    space = sampled_space(group, points, HrpdSpec(dimension=10, samples=40))
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
    blend = skinning_weights(element_centres(group, points), handles)
    maps = rng.standard_normal((handles, 3, 3))
    field = np.einsum("eh,epi,hij->epj", blend, rest.reshape(group.elements, -1, 3), maps)
    field = field.reshape(-1, 3)
    active = int(np.linalg.matrix_rank(rest))
    spec = HrpdSpec(dimension=active * handles, samples=20)
    space = sampled_space(group, points, spec)
    p = group.rows_per_element
    rows = (space.elements[:, None] * p + np.arange(p)).ravel()
    assert len(space.elements) < group.elements or group.elements <= 20
    again = space.V @ (space.operator @ field[rows])
    np.testing.assert_allclose(again, field, atol=1e-7 * np.abs(field).max())


def test_fit_is_weighted_least_squares(group_scene, rng):
    group, points = group_scene.groups[0], group_scene.mesh.points
    space = sampled_space(group, points, HrpdSpec(dimension=6, samples=12))
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
    centres = element_centres(group, points)

    def radius(samples: int) -> float:
        chosen = sampled_space(group, points, HrpdSpec(dimension=2, samples=samples)).elements
        return float(np.linalg.norm(centres[:, None] - centres[chosen], axis=2).min(axis=1).max())

    assert radius(20) < 0.7 * radius(5)
    assert radius(10_000) == 0.0


def test_too_few_samples_are_a_named_error(group_scene):
    group, points = group_scene.groups[0], group_scene.mesh.points
    with pytest.raises(SamplingError, match=f"'{group.name}': 2 samples do not determine a space"):
        sampled_space(group, points, HrpdSpec(dimension=12, samples=2))


def test_a_singular_sample_is_a_named_error(group_scene):
    group = group_scene.groups[0]
    V = np.zeros((group.elements * group.rows_per_element, 2))
    V[:, 0] = 1.0
    with pytest.raises(SamplingError, match="allowed are more samples or a smaller dimension"):
        SampledSpace(group, V, np.arange(group.elements))


def test_a_group_without_rest_vectors_has_no_space():
    scene = make_scene({"effect": "bending", "weight": 1.0})
    assert sampled_space(scene.groups[0], scene.mesh.points, HrpdSpec()) is None
