"""What the rules of the tables get from a study."""

from dataclasses import replace

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.reads import PerScene, Setting, TableOf
from pdrom.pipeline import tables as module
from pdrom.pipeline.study import Study
from pdrom.pipeline.tables import Tables
from pdrom.tables import declared
from places import ROOT

CONFIG = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "block-deim"]}


def made(**changes) -> Tables:
    return Tables(Study.load(CONFIG | changes, ROOT), "out")


def test_verdicts_are_a_table_like_others():
    assert {"claims", "singular_values", "guard"} <= set(declared())
    assert list(made()) == sorted(declared())


@pytest.mark.parametrize("name", declared())
def test_every_table_finds_what_it_reads(name):
    tables = made()
    inputs, settings = tables.inputs(name), tables.params(name)["settings"]
    assert inputs.keys() | settings.keys() == declared()[name].reads.keys()
    assert not inputs.keys() & settings.keys()
    assert tables.path(name) == f"out/tables/{name}.csv"


def test_inputs_are_files_of_the_study_in_its_order():
    tables = made()
    assert tables.inputs("sensitivity") == {
        "parts": ["out/sensitivity/spring_oop.csv", "out/sensitivity/strain_oop.csv"]
    }
    assert tables.inputs("budget") == {"points": "out/tables/accuracy_cost.csv"}
    assert tables.inputs("online")["parts"] == []
    assert tables.inputs("claims")["rules"] == "config/claims.yaml"


@pytest.mark.parametrize(
    ("methods", "basis"),
    [
        (["block-deim", "deim"], "none-affine-vectorised"),
        (["block-deim", "published"], None),
        (["deim", "block-deim", "pod"], None),
    ],
)
def test_of_each_experiments_bases_one_is_read(methods, basis):
    """The one without weights and centring where a method has it, else the first."""
    study = Study.load(CONFIG | {"methods": methods}, ROOT)
    held = list(dict.fromkeys(method.basis_id for method in study.methods.values()))
    expected = "none-none-vectorised" if "none-none-vectorised" in held else held[0]
    assert basis in (None, expected)
    assert Tables(study, "out").inputs("singular_values")["bases"] == [
        f"out/pod/spring_oop/spring/{expected}.h5",
        f"out/pod/strain_oop/strain/{expected}.h5",
    ]


def test_a_setting_is_a_parameter_of_those_who_read_it_only():
    before, after = made(), made(stability={"wrong": 0.3})
    changed = {n for n in before if before.params(n) != after.params(n)}
    assert changed == {"stability"}


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (Setting("stability.wrogn"), "table budget reads the key 'stability.wrogn'.*wrong"),
        (Setting("budgets.more"), "reads the key 'budgets.more'"),
        (PerScene("time_stap"), "scenes have no key 'time_stap'.*time_step"),
        (TableOf("sensitivty"), "reads 'sensitivty'.*sensitivity"),
    ],
)
def test_what_does_not_exist_is_named(read, message, monkeypatch):
    faulty = replace(declared()["budget"], reads={"points": read})
    monkeypatch.setattr(module, "declared", lambda: {**declared(), "budget": faulty})
    tables = made()
    with pytest.raises(ConfigurationError, match=message):
        tables.inputs("budget")
        tables.params("budget")
