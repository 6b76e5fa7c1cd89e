"""The motion in continuous time, and the estimate of its own error."""

import numpy as np
import pytest

from builders import make_scene
from study.experiments.alternatives.solvers.explicit import continuous

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
EFFECTS = ({"effect": "gravity"}, {"effect": "pins", "select": "left"})


def sheet(weight: float):
    return make_scene(*EFFECTS, {"effect": "spring", "weight": weight}, mesh=SHEET)


def test_estimate_is_the_error():
    scene = sheet(1e5)
    fine = continuous(scene, 10, 1e-12, 640, 1300)
    found = continuous(scene, 10, 1e-5, 4, 1000)
    moved = np.linalg.norm(found.positions - found.positions[0])
    error = np.linalg.norm(found.positions - fine.positions) / moved
    assert found.error <= 1e-5
    assert found.error == pytest.approx(error, rel=0.2)
    assert found.positions.shape == (11, 30, 3)


def test_unstable_steps_are_halved():
    """The first steps leave the floating-point numbers; what is returned is accurate."""
    found = continuous(sheet(1e9), 4, 1e-3, 2, 10_000)
    assert found.error <= 1e-3
    assert found.substeps > 100


def test_limit_ends_the_search_and_is_reported():
    found = continuous(sheet(1e5), 4, 1e-15, 10, 40)
    assert found.substeps == 40
    assert found.error > 1e-15
    assert continuous(sheet(1e14), 4, 1e-3, 2, 8).error > 1e-3
