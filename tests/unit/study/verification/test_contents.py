"""The contents of a run: the command of each entry makes its files."""

import shlex

import snakemake.cli  # noqa: F401 : before the graph, which cannot be imported first

from places import ROOT
from study.pipeline.commandline import CommandLine, completed
from study.pipeline.summary import contents, entries
from study.tables import declared

TINY = ["--configfile", "config/tiny.yaml"]


def test_every_command_makes_what_its_entry_names(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    listed = list(entries(subject.plan))
    assert {kind for kind, _, _ in listed} == {"claim", "figure", "table", "manuscript"}
    for kind, name, words in listed:
        command = CommandLine(completed([*words, *TINY]))
        assert command.configfiles == ("config/tiny.yaml",)
        file = {"claim": "tables/claims.csv", "figure": f"figures/{name}.pdf"}
        file["table"] = f"tables/{name}.csv"
        wanted = [] if kind == "manuscript" else [f"{subject.results}/{file[kind]}"]
        assert list(command.targets) == wanted


def test_the_contents_name_every_entry_and_describe_every_column(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    page = contents(CommandLine(TINY), subject.plan)
    assert "run of config/tiny.yaml" in page
    for kind, name, words in entries(subject.plan):
        assert f"| {kind} | {name} | `{shlex.join(['./reproduce', *words, *TINY])}` | " in page
    for table in declared().values():
        assert [c.name for c in table.columns if f"| {c.name} | {c.kind} |" not in page] == []
