"""Settings and fixtures of all tests."""

import os
import signal

import numpy as np
import pytest
from hypothesis import settings

from builders import GROUPS, make_scene
from pdrom.model.scene import Scene

# Hypothesis tries the same few examples in every run, so that a failure can be repeated.
# `PDROM_EXAMPLES=1000 ./reproduce test` tries more examples.
EXAMPLES = int(os.environ.get("PDROM_EXAMPLES", "20"))
settings.register_profile("pdrom", derandomize=True, deadline=None, max_examples=EXAMPLES)
settings.load_profile("pdrom")


def pytest_configure() -> None:
    """Restore interrupts, which a shell may ignore for tests that run in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run files that start Snakemake first: they take minutes, and others run at the same time."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)


@pytest.fixture(params=sorted(GROUPS))
def group_scene(request: pytest.FixtureRequest) -> Scene:
    """One scene per constraint group, which contains only this group."""
    return make_scene({"effect": request.param, "weight": 1e4}, mesh=GROUPS[request.param])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260101)
