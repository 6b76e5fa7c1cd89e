"""What an entry takes is the sum over the jobs that it needs; its command makes its files."""

import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest
import snakemake.cli  # noqa: F401 : before the graph, which cannot be imported first
from snakemake.dag import DAG

from places import ROOT
from study.artifact.usage import Usage
from study.figures.kit.declaration import declarations
from study.pipeline.commandline import CommandLine
from study.pipeline.figure_command import figure_arguments
from study.pipeline.front import completed, files_of
from study.tables import declared
from study.verification.claim_map.entries import entries
from study.verification.claim_map.measured import claim_map
from study.verification.claim_map.pages import contents
from study.verification.subject import Subject

TINY = ["--configfile", "config/tiny.yaml"]


@dataclass(frozen=True)
class Job:
    """A job of Snakemake, as far as it is asked."""

    output: tuple[str, ...]
    log: tuple[str, ...]


class Dag:
    """Jobs that make tables, figures and the manuscript, all of which need the same two others.

    The graph of a run is asked in tests/workflow/test_snakefile.py.
    """

    def __init__(self, subject: Subject) -> None:
        documents = subject.folders.documents.values()
        files = [*subject.plan.table_paths, *subject.plan.figures, *documents]
        first, second = (Job((f"{name}.h5",), (f"logs/{name}.log",)) for name in ("run", "basis"))
        last = [Job((file,), (f"logs/{Path(file).stem}{i}.log",)) for i, file in enumerate(files)]
        self.dependencies = {first: {}, second: {first: {}}} | {job: {second: {}} for job in last}

    jobs = property(lambda self: self.dependencies)
    bfs = DAG.bfs


def test_every_command_asks_for_what_the_entry_names(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    listed = entries(ROOT)
    made = claim_map(Dag(subject), subject.plan, subject.folders, TINY, "tiny")
    table = made.to_dict("records")
    for entry, row in zip(listed, table, strict=True):
        words = list(entry.words)
        assert shlex.split(row["command"]) == ["./reproduce", *words, *TINY]
        targets = figure_arguments(words[1:])[1:] if words[:1] == ["figure"] else words
        made = [file for files in files_of(targets, subject.folders).values() for file in files]
        assert made == ([] if entry.kind == "manuscript" else row["target"].split()), entry


@pytest.mark.parametrize("kind", ["claim", "figure", "table", "section", "manuscript"])
def test_a_command_is_understood_as_a_whole(kind, subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    words = next(entry.words for entry in entries(ROOT) if entry.kind == kind)
    command = CommandLine.parse(completed([*words, *TINY]))
    assert command.configfiles == ("config/tiny.yaml",)
    assert all(target.startswith(subject.results) for target in command.targets)


def test_costs_are_those_of_all_jobs_that_are_needed(subject, tmp_path, monkeypatch):
    dag, plan = Dag(subject), subject.plan
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").symlink_to(ROOT / "config")
    (tmp_path / "paper").symlink_to(ROOT / "paper")
    for job in dag.jobs:
        for file in (*job.log, *job.output):
            Path(file).parent.mkdir(parents=True, exist_ok=True)
        Path(job.log[0]).write_text(f"pdrom: {Usage(1.0, 60.0, 100.0)}\n")
        Path(job.output[0]).write_bytes(bytes(1000))

    def figures():
        table = claim_map(dag, plan, subject.folders, TINY, "tiny")
        return table[table.kind == "figure"].set_index("name")

    decay = figures().loc["singular_values"]
    assert decay.jobs == decay.minutes == 3
    assert (decay.minutes_alone, decay.memory) == (1.0, 100.0)
    assert decay.disk == pytest.approx(0.003)
    # one job that was not measured: nothing is claimed about what needs it
    Path("logs/run.log").write_text("interrupted\n")
    assert figures().loc["singular_values"][["minutes", "memory"]].isna().all()


def test_the_contents_name_every_entry_and_describe_every_figure_and_column(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    made = claim_map(Dag(subject), subject.plan, subject.folders, TINY, "config/tiny.yaml")
    page = contents(made)
    assert "run of config/tiny.yaml" in page
    for entry in entries(ROOT):
        assert f"| {entry.kind} | {entry.name} | `./reproduce " in page
    assert [name for name in declarations() if f"## `{name}`" not in page] == []
    for table in declared().values():
        assert [c.name for c in table.columns if f"| {c.name} | {c.kind} |" not in page] == []
