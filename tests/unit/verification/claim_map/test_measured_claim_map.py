"""What an entry takes is the sum over the jobs that it needs; its command makes its files."""

import shlex
from pathlib import Path

import pytest

from pdrom.core.usage import Usage
from pdrom.pipeline.commandline import CommandLine
from pdrom.pipeline.figure_command import figure_arguments
from pdrom.pipeline.front import completed, files_of
from pdrom.pipeline.graph import Graph
from pdrom.verification.claim_map.entries import entries
from pdrom.verification.claim_map.measured import claim_map
from pdrom.verification.subject import Subject
from places import ROOT

TINY = ["--configfile", "config/tiny.yaml"]


@pytest.fixture(scope="module")
def graph(subject: Subject) -> Graph:
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(ROOT)
        made = Graph(subject.plan)
        made.needed([subject.folders.manuscript])
    return made


def test_every_command_asks_for_what_the_entry_names(subject, graph, monkeypatch):
    monkeypatch.chdir(ROOT)
    listed = entries(ROOT)
    table = claim_map(subject.plan, subject.folders, TINY, "tiny").to_dict("records")
    for entry, row in zip(listed, table, strict=True):
        words = list(entry.words)
        assert shlex.split(row["command"]) == ["./reproduce", *words, *TINY]
        targets = figure_arguments(words[1:])[1:] if words[:1] == ["figure"] else words
        made = [file for files in files_of(targets, subject.folders).values() for file in files]
        assert made == ([] if entry.kind == "manuscript" else row["target"].split()), entry
        makers = [graph.maker(target) for target in row["target"].split()]
        assert None not in makers, entry
        if entry.kind != "section":  # whose numbers are read from tables by a rule of its own
            assert [job.rule for job in makers] == [entry.rule]


@pytest.mark.parametrize("kind", ["claim", "figure", "table", "section", "manuscript"])
def test_a_command_is_understood_as_a_whole(kind, subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    words = next(entry.words for entry in entries(ROOT) if entry.kind == kind)
    command = CommandLine.parse(completed([*words, *TINY]))
    assert command.configfiles == ("config/tiny.yaml",)
    assert all(target.startswith(subject.results) for target in command.targets)


def test_costs_are_those_of_all_jobs_that_are_needed(subject, graph, tmp_path, monkeypatch):
    jobs = graph.needed([subject.folders.manuscript])
    plan = subject.plan
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").symlink_to(ROOT / "config")
    (tmp_path / "paper").symlink_to(ROOT / "paper")
    for job in jobs:
        log = Path(job.log)
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(f"pdrom: {Usage(1.0, 60.0, 100.0)}\n")
        Path(job.outputs[0]).parent.mkdir(parents=True, exist_ok=True)
        Path(job.outputs[0]).write_bytes(bytes(1000))

    def figures():
        table = claim_map(plan, subject.folders, TINY, "tiny")
        return table[table.kind == "figure"].set_index("name")

    decay = figures().loc["singular_values"]
    needed = graph.needed([plan.figure_jobs["singular_values"].pdf])
    assert decay.jobs == decay.minutes == len(needed) > 5
    assert (decay.minutes_alone, decay.memory) == (1.0, 100.0)
    assert decay.disk == pytest.approx(len(needed) / 1000)
    # one job that was not measured: nothing is claimed about what needs it
    Path(needed[-1].log).write_text("interrupted\n")
    assert figures().loc["singular_values"][["minutes", "memory"]].isna().all()
