"""``./reproduce verify`` on a folder of results: outcomes, exit codes, the page."""

import json
import re
from pathlib import Path
from subprocess import CompletedProcess
from types import SimpleNamespace

import pytest

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.store import read_table, write_table, write_text
from study.article.build import INDEX, VERIFIED
from study.artifact.paths import ARTICLE, TABLE
from study.figures.kit.declaration import declarations
from study.tables import declared
from study.verification.command import NOTHING, status_of, update, verify, verify_tables
from study.verification.examine import Line, Outcome
from study.verification.files import made
from study.verification.references import LOG, folder_of
from study.verification.subject import Status

RESULTS = "results/studies/tiny"
CLAIMS = ("claims", "claims_tests", "claims_sensitivity")


@pytest.fixture
def verified(results, subject, capsys):
    """Exit code and printed lines of the comparison when it is asked."""

    def asked():
        status = verify_tables(subject)
        return status, capsys.readouterr().out.splitlines()

    return asked


def test_expected_results_hold_and_outcomes_reach_an_article(results, verified):
    status, printed = verified()
    page = (results / RESULTS / "verification.md").read_text(encoding="utf-8")
    assert not any("differs" in line or "not there" in line for line in printed)
    assert status == Status.HOLDS
    names = {line.split(":")[0] for line in printed}
    assert {f"table {name}" for name in declared()} <= names
    assert {"claim C1", "claim C12", "figure singular_values"} <= names
    assert any(re.match("table [a-z_]+: not comparable", line) for line in printed)
    assert "| C1 | reproduced |" in page
    place = Path(ARTICLE.at(RESULTS, name=VERIFIED))
    assert not place.exists()
    write_text("<!DOCTYPE html>", place.with_name(INDEX))
    *lines, _, _ = verified()[1]
    text = place.read_text(encoding="utf-8")
    found = json.loads(text.removeprefix("window.pdromVerified=").removesuffix(";\n"))
    assert found == dict(line.split(": ", 1) for line in lines)
    assert {f"figure {name}" for name in declarations()} <= found.keys()


def decided_again(examination, table, **columns):
    """Claims by name, decided again of a table with other columns; and lines of their tables."""
    path = TABLE.at(RESULTS, name=table)
    write_table(read_table(path).assign(**columns), path)
    for name in CLAIMS:
        with made(examination.subject.plan.job(declared()[name])) as files:
            [(path, new)] = files.items()
            write_table(read_table(new), path)
    lines = {line.name: line for line in examination.claims()}
    return lines, [examination.table(name) for name in CLAIMS]


def test_a_verdict_that_times_have_changed_is_shown_and_not_judged(examination):
    shares = read_table(TABLE.at(RESULTS, name="local_share")).local_share
    slow = shares.median() >= 0.7
    claims, tables = decided_again(examination, "local_share", local_share=0.1 if slow else 0.9)
    assert claims["C1"].outcome is Outcome.NOT_COMPARABLE
    now = "does not hold" if slow else "holds"
    assert f"found '{now}', which rests on times" in claims["C1"].text
    assert [str(table) for table in tables if table.details] == []


def test_a_verdict_that_errors_have_changed_is_a_difference(examination):
    errors = read_table(TABLE.at(RESULTS, name="reconstruction_error")).elements_sampled
    one = errors.where(errors.isna(), 1)
    claims, tables = decided_again(examination, "reconstruction_error", elements_sampled=one)
    assert claims["C8"].outcome is tables[0].outcome is Outcome.DIFFERS


def test_what_is_missing_has_its_own_code_and_names_its_command(verified):
    reference = folder_of(RESULTS) / "winners.csv"
    kept = reference.read_bytes()
    for path in (TABLE.at(RESULTS, name="stability"), f"{RESULTS}/figures/ladder.png", reference):
        Path(path).unlink()
    status, printed = verified()
    reference.write_bytes(kept)
    assert status == Status.MISSING
    assert "table winners: no reference, run verify --update" in printed
    [line] = [line for line in printed if line.startswith("table stability")]
    assert line.endswith("make it by ./reproduce --configfile config/tiny.yaml -- stability")
    assert any(line.startswith("figure stability_map: not there") for line in printed)
    [line] = [line for line in printed if line.startswith("figure ladder:")]
    assert "ladder.png is not there; make it by ./reproduce" in line


def test_the_code_is_that_of_the_worst_outcome():
    """Of more and more outcomes, each worse than those before it."""
    order = "REPRODUCED", "NOT_COMPARABLE", "NO_REFERENCE", "DIFFERS", "MISSING"
    lines = [Line("table", "a", Outcome[name]) for name in order]
    assert [status_of(lines[:count]) for count in range(1, 6)] == [0, 0, 3, 3, 4]
    assert status_of([lines[0], lines[3]]) == Status.DIFFERS


def test_a_configuration_without_references_and_options_that_clash_are_refused(results, tmp_path):
    own = tmp_path / "other.yaml"
    own.write_text("ranks: [6]\n")
    with pytest.raises(ConfigurationError, match="no expected tables of this configuration"):
        verify(["--configfile", str(own)])
    for words in (["--no-such-option"], ["--update", "--files"]):
        with pytest.raises(SystemExit):
            verify(words)


def plan_says(monkeypatch, code: int, words: str) -> None:
    """In place of Snakemake, which would plan the tables: its exit code and ``words``."""
    done = CompletedProcess([], code, words, "")
    run = SimpleNamespace(run=lambda *_, **__: done)
    monkeypatch.setattr("study.verification.command.subprocess", run)


def test_an_update_writes_every_table_and_notes_the_reason(results, subject, monkeypatch):
    plan_says(monkeypatch, 0, NOTHING)
    folder = folder_of(RESULTS)
    before = {path.name: path.read_bytes() for path in folder.glob("*.csv*")}
    (folder / "ladder.csv").unlink()
    (folder / "of_an_older_version.csv.xz").touch()
    assert update(subject, " a new\n method ") == folder
    assert (folder / LOG).read_text("utf-8").endswith("): a new method\n")
    (folder / LOG).unlink()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("code", "words", "fault"),
    [(1, "", "the run cannot be planned"), (0, "Job stats", "older than what they are made from")],
)
def test_tables_that_a_run_would_make_again_are_not_expected(
    results, subject, monkeypatch, code, words, fault
):
    plan_says(monkeypatch, code, words)
    with pytest.raises(StorageError, match=fault):
        update(subject, "a new method")
    assert not (folder_of(RESULTS) / LOG).exists()
