"""Shared builders of small scenes."""

import signal
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import settings

from pdrom.model.scene import Scene, SceneConfig
from places import ROOT

# The same examples in every run: a failure can be repeated, and no run depends on the clock.
settings.register_profile("pdrom", derandomize=True, deadline=None)
settings.load_profile("pdrom")


def pytest_configure() -> None:
    """A shell that runs the tests in the background may have them ignore interrupts."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


GROUPS = {
    "bending": {"kind": "cloth", "rows": 7, "columns": 6, "wave": 0.1},
    "spring": {"kind": "cloth", "rows": 6, "columns": 5},
    "strain": {"kind": "cloth", "rows": 6, "columns": 5},
    "tetrahedron_strain": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "deformation_gradient": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "volume": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "area": {"kind": "cloth", "rows": 6, "columns": 5},
}


def make_scene(
    *effects: dict, mesh: dict | None = None, frames: int = 20, **settings: object
) -> Scene:
    """Scene of the given effects on a small mesh."""
    config = SceneConfig.model_validate(
        {
            "name": "test",
            "title": "test",
            "mesh": mesh or {"kind": "cloth", "rows": 6, "columns": 5},
            "frames": frames,
            "effects": list(effects),
            **settings,
        }
    )
    return Scene.build(config, config.mesh.build(ROOT))


@pytest.fixture
def scene_of() -> Callable[..., Scene]:
    """Builder of scenes, see `make_scene`."""
    return make_scene


@pytest.fixture(params=sorted(GROUPS))
def group_scene(request: pytest.FixtureRequest) -> Scene:
    """One scene per constraint group, nothing but the group in it."""
    return make_scene({"effect": request.param, "weight": 1e4}, mesh=GROUPS[request.param])


@pytest.fixture
def rng() -> np.random.Generator:
    """Seeded generator."""
    return np.random.default_rng(20260101)


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """Uniformly distributed rotation (3, 3)."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))
