"""Names that are loaded on demand."""

import json

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.registry import Registry
from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.effects import EFFECTS
from pdrom.reduction.method import SELECTIONS

ENTRIES = {"loads": "json:loads", "absent": "no.such.module:x"}
REGISTRY = Registry("thing", ENTRIES)


def test_is_a_read_only_mapping():
    assert list(REGISTRY) == ["loads", "absent"]
    assert len(REGISTRY) == 2
    assert "loads" in REGISTRY
    assert "other" not in REGISTRY
    assert REGISTRY["loads"] == "json:loads"
    assert REGISTRY.module("loads") == "json"
    assert REGISTRY.load("loads") is json.loads
    with pytest.raises(TypeError):
        REGISTRY["new"] = "json:dumps"
    ENTRIES["new"] = "json:dumps"
    assert list(REGISTRY) == ["loads", "absent"]


@pytest.mark.parametrize("ask", [REGISTRY.load, REGISTRY.module, REGISTRY.__getitem__])
def test_unknown_names_list_what_is_allowed(ask):
    with pytest.raises(
        ConfigurationError, match=r"unknown thing 'other' \(allowed: absent, loads\)"
    ):
        ask("other")


@pytest.mark.parametrize("registry", [EFFECTS, SOLVERS, SELECTIONS], ids=lambda r: r.kind)
def test_every_entry_of_the_package_exists(registry):
    for name in registry:
        assert callable(registry.load(name))
