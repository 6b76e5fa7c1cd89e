"""What an entry takes is the sum over the jobs that it needs; its command makes its files."""

import shlex
from collections import namedtuple
from pathlib import Path

import snakemake.cli  # noqa: F401 : before the graph, which cannot be imported first
from snakemake.dag import DAG

from places import ROOT
from study.artifact.logs import Usage
from study.figures.kit.declaration import declarations
from study.pipeline.commandline import CommandLine
from study.pipeline.front import completed
from study.pipeline.summary import contents, costs, entries
from study.pipeline.targets import own_file
from study.tables import declared
from study.verification.subject import Subject

TINY = ["--configfile", "config/tiny.yaml"]


Job = namedtuple("Job", "output log")  # a job of Snakemake, as far as it is asked


class Dag:
    """Jobs that make tables, figures and the manuscript, all of which need the same two others.

    The graph of a run is asked in tests/workflow/test_snakefile.py.
    """

    def __init__(self, subject: Subject) -> None:
        files = subject.plan.made
        first, second = (Job((f"{name}.h5",), (f"logs/{name}.log",)) for name in ("run", "basis"))
        last = [Job((file,), (f"logs/{Path(file).stem}{i}.log",)) for i, file in enumerate(files)]
        self.dependencies = {first: {}, second: {first: {}}} | {job: {second: {}} for job in last}

    jobs = property(lambda self: self.dependencies)
    bfs = DAG.bfs


def test_every_command_makes_what_its_entry_names(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    listed = list(entries())
    assert {entry.kind for entry in listed} == {
        "claim", "figure", "table", "section", "manuscript",
    }  # fmt: skip
    for entry in listed:
        command = CommandLine(completed([*entry.words, *TINY]))
        assert command.configfiles == ("config/tiny.yaml",)
        wanted = (
            []
            if entry.kind == "manuscript"
            else [own_file(file, subject.folders) for file in entry.files]
        )
        assert list(command.targets) == wanted, entry


def test_costs_are_those_of_all_jobs_that_are_needed(subject, tmp_path, monkeypatch):
    dag = Dag(subject)
    monkeypatch.chdir(ROOT)
    listed = [entry for entry in entries() if entry.name == "singular_values"]
    monkeypatch.chdir(tmp_path)
    for job in dag.jobs:
        for file in (*job.log, *job.output):
            Path(file).parent.mkdir(parents=True, exist_ok=True)
        Path(job.log[0]).write_text(f"pdrom: {Usage(1.0, 60.0, 100.0)}\n")
    assert [*costs(listed, dag, subject.folders)] == [(3, 3.0)] * 2
    # one job that was not measured: nothing is claimed about what needs it
    Path("logs/run.log").write_text("interrupted\n")
    assert [*costs(listed, dag, subject.folders)] == [(3, None)] * 2


def test_the_contents_name_every_entry_and_describe_every_figure_and_column(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    page = contents(CommandLine(TINY), Dag(subject), subject.folders)
    assert "run of config/tiny.yaml" in page
    for entry in entries():
        command = shlex.join(["./reproduce", *entry.words, *TINY])
        assert f"| {entry.kind} | {entry.name} | `{command}` | " in page
    assert [name for name in declarations() if f"## `{name}`" not in page] == []
    for table in declared().values():
        assert [c.name for c in table.columns if f"| {c.name} | {c.kind} |" not in page] == []
