"""``./reproduce verify`` on a folder of results: outcomes, exit codes, the page."""

import shutil

import pandas as pd
import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import TABLE
from pdrom.core.store import atomic_path, read_table, write_table
from pdrom.pipeline.tables import all_tables
from pdrom.verification.command import parser, verify
from pdrom.verification.references import folder_of, write_reference
from pdrom.verification.status import Status
from pdrom.verification.subject import Subject
from places import ROOT

OPTIONS = ["--configfile", "config/tiny.yaml"]
RESULTS = "results/studies/tiny"


def make(path):
    """A small file with its checksum."""
    with atomic_path(path) as temporary:
        temporary.write_text("there\n")


@pytest.fixture(scope="module")
def results(expected, tmp_path_factory):
    """A project with the expected tables as results, and every file that figures read."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("config", "paper", "src"):
        (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "results" / "reference", folder / "results" / "reference")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("os.fsync", lambda descriptor: None)
        for name, table in all_tables().items():
            frame = expected.get(name, table.checked(pd.DataFrame()))
            write_table(frame, TABLE.at(RESULTS, name=name))
            # a new table or column has no tracked reference until a run is taken as one
            write_reference(table, frame, folder_of(RESULTS))
        figures = Subject.of(OPTIONS[1:], []).plan.figure_jobs.values()
        tables = {TABLE.at(RESULTS, name=name) for name in all_tables()}
        read = {path for job in figures for path in job.inputs if path.startswith("results/")}
        for path in (read - tables) | {p for job in figures for p in (job.pdf, job.png)}:
            make(path)
    return folder


@pytest.fixture
def project(results, monkeypatch):
    """The folder of the project, entered."""
    monkeypatch.chdir(results)
    return results


def lines(capsys, start):
    """Printed lines that begin with ``start``."""
    return [line for line in capsys.readouterr().out.splitlines() if line.startswith(start)]


def test_expected_results_hold(project, capsys):
    assert verify(OPTIONS) == Status.HOLDS
    printed = capsys.readouterr().out.splitlines()
    names = {line.split(":")[0] for line in printed}
    assert {f"table {name}" for name in all_tables()} <= names
    assert {"claim C1", "claim C12", "figure singular_values"} <= names
    assert not any("differs" in line or "not there" in line for line in printed)
    assert any(line.startswith("table effects_left_out: not comparable") for line in printed)
    page = (project / RESULTS / "verification.md").read_text(encoding="utf-8")
    assert "| C1 | reproduced |" in page


def test_a_changed_verdict_and_a_table_without_reference_are_told(project, capsys):
    path = TABLE.at(RESULTS, name="claims")
    before = read_table(path)
    after = before.copy()
    after.loc[after.claim == "C5", "verdict"] = "holds"
    write_table(after, path)
    reference = project / "results" / "reference" / "studies" / "tiny" / "tables" / "alarms.csv"
    aside = reference.rename(reference.with_suffix(".aside"))
    try:
        assert verify(OPTIONS) == Status.DIFFERS
    finally:
        write_table(before, path)
        aside.rename(reference)
    printed = lines(capsys, ("claim C5", "table alarms"))
    assert printed == [
        "claim C5: differs, as published: expected 'cannot be decided', found 'holds'",
        "table alarms: no reference, run verify --update",
    ]


def test_what_is_missing_has_its_own_code_and_names_its_command(project, capsys):
    paths = [
        project / TABLE.at(RESULTS, name="noise"),
        project / RESULTS / "figures" / "ladder.png",
    ]
    aside = [path.rename(path.with_suffix(".aside")) for path in paths]
    try:
        assert verify(OPTIONS) == Status.MISSING
    finally:
        for kept, path in zip(aside, paths, strict=True):
            kept.rename(path)
    printed = capsys.readouterr().out.splitlines()
    [line] = [line for line in printed if line.startswith("table noise")]
    assert line.endswith("make it by ./reproduce --configfile config/tiny.yaml -- noise")
    assert any(line.startswith("figure noise_runs: not there") for line in printed)
    [line] = [line for line in printed if line.startswith("figure ladder:")]
    assert "ladder.png is not there; make it by ./reproduce" in line


def test_a_configuration_without_references_is_refused(project, tmp_path):
    own = tmp_path / "other.yaml"
    own.write_text("ranks: [6]\n")
    with pytest.raises(ConfigurationError, match="no expected tables of this configuration"):
        verify(["--configfile", str(own)])


def test_update_goes_with_nothing_else():
    with pytest.raises(SystemExit):
        parser().parse_args(["--no-such-option"])
    assert parser().parse_args(["--update", "--reason", "why"]).reason == "why"
