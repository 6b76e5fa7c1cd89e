"""The contents of a run: the command of each entry makes its files."""

import re
import shlex

import snakemake.cli  # noqa: F401 : before the graph, which cannot be imported first

from places import ROOT
from study.pipeline.commandline import CommandLine, completed
from study.pipeline.summary import contents
from study.tables import declared

TINY = ["--configfile", "config/tiny.yaml"]


def test_every_command_makes_the_files_of_its_entry_and_every_column_is_described(
    subject, monkeypatch
):
    monkeypatch.chdir(ROOT)
    page = contents(CommandLine(TINY), subject.plan)
    listed = re.findall(r"^\| (\w+) \| (\S+) \| `\./reproduce (.*)` \|$", page, re.M)
    assert {kind for kind, _, _ in listed} == {"figure", "table", "manuscript"}
    for kind, name, words in listed:
        command = CommandLine(completed(shlex.split(words)))
        assert command.configfiles == ("config/tiny.yaml",)
        file = {"figure": f"figures/{name}.pdf", "table": f"tables/{name}.csv"}
        wanted = [] if kind == "manuscript" else [f"{subject.results}/{file[kind]}"]
        assert list(command.targets) == wanted
    for table in declared().values():
        assert [c.name for c in table.columns if f"| {c.name} | {c.kind} |" not in page] == []
