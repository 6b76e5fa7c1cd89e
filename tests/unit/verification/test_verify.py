"""``./reproduce verify`` on a folder of results: outcomes, exit codes, the page."""

import io
import shutil
from contextlib import redirect_stdout
from pathlib import Path

import pandas as pd
import pytest
from settled_times import CHANGED, LOSING, deciding_runs

from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import TABLE
from pdrom.core.store import read_table, write_hdf5, write_table, write_text
from pdrom.pipeline.tables import all_tables
from pdrom.verification.command import parser, verify, verify_tables
from pdrom.verification.lines import Line, Outcome, status_of
from pdrom.verification.references import folder_of, kept, write_reference
from pdrom.verification.status import Status
from places import ROOT

RESULTS = "results/studies/tiny"


def make(path):
    """A small file with its checksum."""
    if path.endswith(".h5"):
        with write_hdf5(path):
            return
    write_text("there\n", path)


@pytest.fixture(scope="module")
def results(expected, references, subject, tmp_path_factory):
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
            new = name not in references or set(kept(table)) - set(references[name].columns)
            if new or name in CHANGED:
                # a new table or column has no tracked reference until a run is taken as one
                write_reference(table, frame, folder_of(RESULTS))
        figures = subject.plan.figure_jobs.values()
        tables = {TABLE.at(RESULTS, name=name) for name in all_tables()}
        read = {path for job in figures for path in job.inputs if path.startswith("results/")}
        for path in (read - tables) | {p for job in figures for p in (job.pdf, job.png)}:
            make(path)
    return folder


def verified(subject):
    """Exit code and printed lines."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        status = verify_tables(subject)
    return status, printed.getvalue().splitlines()


@pytest.fixture(scope="module")
def held(results, subject):
    """Code, lines and page of the expected tables themselves."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(results)
        status, printed = verified(subject)
    return status, printed, (results / RESULTS / "verification.md").read_text(encoding="utf-8")


def test_expected_results_hold(held):
    status, printed, page = held
    assert status == Status.HOLDS
    names = {line.split(":")[0] for line in printed}
    assert {f"table {name}" for name in all_tables()} <= names
    assert {"claim C1", "claim C12", "figure singular_values"} <= names
    assert not any("differs" in line or "not there" in line for line in printed)
    assert any(line.startswith("table effects_left_out: not comparable") for line in printed)
    assert "| C1 | reproduced |" in page


@pytest.fixture(scope="module")
def faulty(results, subject, held):
    """Code and lines where verdicts have changed, and files and a reference are not there.

    After ``held``, since it takes away what that needs.
    """
    claims, reruns = (TABLE.at(RESULTS, name=name) for name in ("claims", "reduced_reruns"))
    reference = folder_of(RESULTS) / "alarms.csv"
    lost = [TABLE.at(RESULTS, name="noise"), f"{RESULTS}/figures/ladder.png"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(results)
        patch.setattr("os.fsync", lambda descriptor: None)
        verdicts, runs = read_table(claims), read_table(reruns)
        verdicts.loc[verdicts.claim == "C5", "verdict"] = "holds"
        verdicts.loc[verdicts.claim == "C11", "verdict_beyond"] = "depends"
        runs.loc[deciding_runs({"reduced_reruns": runs})[LOSING], "speedup"] = 0.98
        write_table(verdicts, claims)
        write_table(runs, reruns)
        for path in (*lost, reference):
            Path(path).unlink()
        return verified(subject)


def test_a_changed_verdict_and_a_table_without_reference_are_told(faulty):
    _, printed = faulty
    assert [line for line in printed if line.startswith(("claim C5", "table alarms"))] == [
        "claim C5: differs, as published: expected 'cannot be decided', found 'holds'",
        "table alarms: no reference, run verify --update",
    ]


def test_a_verdict_that_times_have_changed_is_not_comparable(faulty):
    _, printed = faulty
    assert (
        "claim C11: not comparable on this machine, beyond: expected 'does not hold', "
        "found 'depends', which rests on times (2 of 9 against 3 of 9)"
    ) in printed
    [line] = [line for line in printed if line.startswith("table claims:")]
    assert "as published" not in line
    assert "C5" in line  # the only one that differs
    assert " more" not in line


def test_what_is_missing_has_its_own_code_and_names_its_command(faulty):
    status, printed = faulty
    assert status == Status.MISSING
    [line] = [line for line in printed if line.startswith("table noise")]
    assert line.endswith("make it by ./reproduce --configfile config/tiny.yaml -- noise")
    assert any(line.startswith("figure noise_runs: not there") for line in printed)
    [line] = [line for line in printed if line.startswith("figure ladder:")]
    assert "ladder.png is not there; make it by ./reproduce" in line


@pytest.mark.parametrize(
    ("outcomes", "status"),
    [
        ([Outcome.REPRODUCED, Outcome.NOT_COMPARABLE], Status.HOLDS),
        ([Outcome.NO_REFERENCE, Outcome.REPRODUCED], Status.DIFFERS),
        ([Outcome.REPRODUCED, Outcome.DIFFERS, Outcome.NOT_COMPARABLE], Status.DIFFERS),
        ([Outcome.MISSING, Outcome.DIFFERS], Status.MISSING),
    ],
)
def test_the_code_is_that_of_the_worst_outcome(outcomes, status):
    assert status_of([Line("table", "a", outcome) for outcome in outcomes]) == status


def test_a_configuration_without_references_is_refused(results, tmp_path, monkeypatch):
    monkeypatch.chdir(results)
    own = tmp_path / "other.yaml"
    own.write_text("ranks: [6]\n")
    with pytest.raises(ConfigurationError, match="no expected tables of this configuration"):
        verify(["--configfile", str(own)])


def test_update_goes_with_nothing_else():
    with pytest.raises(SystemExit):
        parser().parse_args(["--no-such-option"])
    assert parser().parse_args(["--update", "--reason", "why"]).reason == "why"
