"""Provenance of results: equal for equal jobs, different for different settings."""

import json
from importlib.metadata import version
from pathlib import Path

import pytest

from pdrom import __version__
from pdrom.core import provenance
from pdrom.core.provenance import made_by


def configuration_hash(configuration: object) -> str:
    with made_by("a job", configuration):
        return provenance.provenance()["configuration_sha256"]


@pytest.mark.parametrize(
    "other", [{"a": 2, "b": [1, 2]}, {"a": 1, "b": [2, 1]}, {"a": 1}, {"a": "1", "b": [1, 2]}]
)
def test_the_hash_depends_on_every_value_and_not_on_the_order_of_keys(other):
    reference = configuration_hash({"a": 1, "b": [1, 2]})
    assert configuration_hash({"b": [1, 2], "a": 1}) == reference
    assert configuration_hash(other) != reference


def test_attributes_of_a_job_are_repeatable_and_contain_the_configuration():
    configuration = {"scene": "bend_fall", "path": Path("a/b")}
    with made_by("fom", configuration, "c0de"):
        first, second = provenance.attributes(), provenance.attributes()
    assert first == second
    assert json.loads(first["configuration"]) == {"scene": "bend_fall", "path": "a/b"}
    assert first["configuration_sha256"] == configuration_hash(configuration)
    assert (first["made_by"], first["code_sha256"]) == ("fom", "c0de")
    assert first["pdrom_version"] == __version__
    assert f"numpy {version('numpy')}" in first["library_versions"]
    assert all(isinstance(value, str) for value in first.values())


def test_a_record_contains_the_declared_keys_and_ends_with_its_job():
    with pytest.raises(ValueError, match="inside"), made_by("ladder", {}, "c0de"):
        assert list(provenance.provenance()) == list(provenance.RECORD)
        raise ValueError("inside")
    assert set(provenance.RECORD) - set(provenance.provenance()) == {
        "made_by", "configuration_sha256", "code_sha256",
    }  # fmt: skip
