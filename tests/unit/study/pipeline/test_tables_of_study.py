"""What the jobs of the tables get from a study; the list of tables for readers is up to date."""

from dataclasses import replace

import pytest

from pdrom.core.errors import ConfigurationError
from places import ROOT
from study.artifact.reads import Setting, TableOf
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.resolve import Job
from study.pipeline.study import Study
from study.tables import declared

CONFIG = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "block-deim"]}


def plan(**changes) -> Plan:
    return Plan(Study.load(CONFIG | changes, ROOT), Folders("out"))


def made(name: str, **changes) -> Job:
    return plan(**changes).job(declared()[name])


def test_verdicts_are_a_table_like_others():
    assert {"claims", "singular_values", "winners"} <= set(declared())
    assert list(declared()) == sorted(declared())


@pytest.mark.parametrize("name", declared())
def test_every_table_finds_what_it_reads(name):
    job = made(name)
    assert job.inputs.keys() | job.settings.keys() == declared()[name].reads.keys()
    assert not job.inputs.keys() & job.settings.keys()
    assert job.outputs == {"table": f"out/tables/{name}.csv"}


def test_inputs_are_files_of_the_study_in_its_order():
    assert made("sensitivity").inputs == {
        "parts": ["out/sensitivity/spring_oop.csv", "out/sensitivity/strain_oop.csv"]
    }
    assert made("payoff").inputs == {"reruns": "out/tables/reduced_reruns.csv"}
    assert made("online").inputs["parts"] == []
    assert made("claims").inputs["rules"] == "config/claims.yaml"


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
    assert made("singular_values", methods=methods).inputs["bases"] == [
        f"out/pod/spring_oop/spring/{expected}.h5",
        f"out/pod/strain_oop/strain/{expected}.h5",
    ]


def test_a_setting_is_a_parameter_of_those_who_read_it_only():
    before, after = plan(), plan(stability={"wrong": 0.3})
    tables = declared().values()
    changed = {t.name for t in tables if before.job(t).settings != after.job(t).settings}
    assert changed == {"stability"}


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (Setting("stability.wrogn"), "table payoff reads the key 'stability.wrogn'.*wrong"),
        (Setting("ranks.more"), "reads the key 'ranks.more'"),
        (TableOf("sensitivty"), "reads 'sensitivty'.*sensitivity"),
    ],
)
def test_what_does_not_exist_is_named(read, message):
    asked = plan()
    asked.tables = {"payoff": replace(declared()["payoff"], reads={"reruns": read})}
    with pytest.raises(ConfigurationError, match=message):
        asked.check()
