"""Attributes of result files: the same for equal runs, different for different settings."""

import json
from importlib.metadata import version
from pathlib import Path

import pytest

from pdrom import __version__
from pdrom.core import provenance


def test_hash_does_not_depend_on_the_order_of_keys():
    one, two = {"a": 1, "b": {"c": [1, 2], "d": None}}, {"b": {"d": None, "c": [1, 2]}, "a": 1}
    assert provenance.configuration_hash(one) == provenance.configuration_hash(two)


@pytest.mark.parametrize(
    "other", [{"a": 2, "b": [1, 2]}, {"a": 1, "b": [2, 1]}, {"a": 1}, {"a": "1", "b": [1, 2]}]
)
def test_hash_depends_on_every_value(other):
    reference = provenance.configuration_hash({"a": 1, "b": [1, 2]})
    assert provenance.configuration_hash(other) != reference


def test_attributes_are_repeatable_and_hold_the_configuration():
    configuration = {"scene": "bend_fall", "path": Path("a/b")}
    first, second = provenance.attributes(configuration), provenance.attributes(configuration)
    assert first == second
    assert json.loads(first["configuration"]) == {"scene": "bend_fall", "path": "a/b"}
    assert first["configuration_sha256"] == provenance.configuration_hash(configuration)
    assert first["pdrom_version"] == __version__
    assert all(isinstance(value, str) for value in first.values())


def test_versions_are_those_installed_and_absent_ones_are_said(monkeypatch):
    monkeypatch.setattr(provenance, "LIBRARIES", ("numpy", "no-such-library"))
    provenance.library_versions.cache_clear()
    try:
        assert provenance.library_versions() == {
            "numpy": version("numpy"),
            "no-such-library": "absent",
        }
    finally:
        provenance.library_versions.cache_clear()
