"""Settings and fixtures of all tests."""

import os
import signal

import numpy as np
import pytest
from hypothesis import settings

from builders import GROUPS, make_scene
from pdrom.model.scene import Scene

# The same few examples in every run: a failure can be repeated, and no run depends on the clock.
# `PDROM_EXAMPLES=1000 ./reproduce test` looks longer.
EXAMPLES = int(os.environ.get("PDROM_EXAMPLES", "20"))
settings.register_profile("pdrom", derandomize=True, deadline=None, max_examples=EXAMPLES)
settings.load_profile("pdrom")


def pytest_configure() -> None:
    """A shell that runs the tests in the background may have them ignore interrupts."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that start Snakemake take minutes: first, so that no process ends alone with them."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)


@pytest.fixture(params=sorted(GROUPS))
def group_scene(request: pytest.FixtureRequest) -> Scene:
    """One scene per constraint group, nothing but the group in it."""
    return make_scene({"effect": request.param, "weight": 1e4}, mesh=GROUPS[request.param])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260101)
