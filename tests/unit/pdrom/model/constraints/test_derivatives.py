"""Derivatives of projections against differences of the NumPy reference; finite for points."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.constraints.derivatives import KINDS, PAIRS, derivatives
from pdrom.model.effects import EFFECTS

NAMES = [name for name in GROUPS if EFFECTS.load(name).manifold in {*KINDS} - {"half sphere"}]


@pytest.mark.parametrize("scale", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("name", NAMES)
def test_derivatives_equal_differences_with_eigenvalues_of_at_most_one(name, scale, rng):
    scene = make_scene({"effect": name, "weight": 1.0}, mesh=GROUPS[name])
    group = scene.groups[0].for_run()
    e, rows, every = group.elements, group.rows_per_element, np.arange(group.elements)
    rest = (group.S @ scene.mesh.points).reshape(e, rows, 3)
    d = scale * (rest + 0.4 * np.abs(rest).max() * rng.standard_normal(rest.shape))
    step, columns = 1e-6 * np.abs(d).max(), []
    for unit in np.eye(3 * rows).reshape(-1, 1, 3, rows).swapaxes(2, 3):
        ends = [group.reference_project(d + h * unit, every) for h in (step, -step)]
        columns.append((ends[0] - ends[1]).swapaxes(1, 2).reshape(e, -1) / (2.0 * step))
    values, vectors = np.linalg.eigh(np.stack(columns, axis=2))
    wanted = (vectors * np.minimum(values, 1.0)[:, None]) @ vectors.swapaxes(1, 2)
    out, allowed = np.empty((e, PAIRS, rows, rows)), np.array(group.allowed or (0.0, 0.0))
    for own in (0.0 * d, d):
        arrays = own.ravel(), group.reference_project(own, every).ravel(), allowed
        derivatives(KINDS[group.manifold], rows, *arrays, np.full(e * rows, 2.0), e, out.ravel())
        assert np.isfinite(out).all()
    blocks = wanted.reshape(e, 3, rows, 3, rows).swapaxes(2, 3)[:, *np.triu_indices(3)]
    np.testing.assert_allclose(out, 2.0 * blocks, atol=1e-7)
