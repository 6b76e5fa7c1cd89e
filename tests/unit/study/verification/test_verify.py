"""``./reproduce verify`` on a folder of results: outcomes, exit codes, the page.

Edits of tables with new checksums, as a sceptic would try them, are noticed.
"""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.store import atomic_path, read_table, write_table, write_text
from study.article.build import INDEX, VERIFIED
from study.artifact.paths import ARTICLE, TABLE
from study.figures.kit.declaration import declarations
from study.tables import declared
from study.verification.command import status_of, update, verify, verify_tables
from study.verification.compare import LOG, folder_of
from study.verification.examine import Examination, Line, Outcome
from study.verification.subject import Status

RESULTS = "results/studies/tiny"
PAGE = Path(ARTICLE.at(RESULTS, name=VERIFIED))


def test_expected_results_pass_and_an_article_shows_the_outcomes(results, subject, capsys):
    write_text("<!DOCTYPE html>", PAGE.with_name(INDEX))
    assert verify_tables(subject) == Status.HOLDS
    printed = capsys.readouterr().out.splitlines()
    text = PAGE.read_text(encoding="utf-8")
    found = json.loads(text.removeprefix("window.pdromVerified=").removesuffix(";\n"))
    assert found == dict(line.split(": ", 1) for line in printed[:-2])
    assert {f"figure {name}" for name in declarations()} <= found.keys()
    assert {"claim C1", "claim C12", *(f"table {name}" for name in declared())} <= found.keys()
    page = (results / RESULTS / "verification.md").read_text(encoding="utf-8")
    assert "- claim C1: reproduced, " in page


def test_a_verdict_changed_by_times_is_shown_and_does_not_fail(examination):
    path = TABLE.at(RESULTS, name="local_share")
    slow = read_table(path).local_share.median() >= 0.7
    write_table(read_table(path).assign(local_share=0.1 if slow else 0.9), path)
    for name in ("claims", "claims_tests", "claims_sensitivity"):
        job = examination.subject.plan.job(declared()[name])
        job.make(job.outputs)
    lines = {line.name: line for line in examination.claims(examination.table("claims"))}
    assert lines["C1"].outcome is Outcome.NOT_COMPARABLE
    now = "does not hold" if slow else "holds"
    assert f"found '{now}', which depends on times" in lines["C1"].text
    tables = [examination.table(name) for name in ("claims", "claims_tests", "claims_sensitivity")]
    assert [str(table) for table in tables if table.outcome is Outcome.DIFFERS] == []


@pytest.fixture
def not_made_again(monkeypatch):
    """Skip computing tables from other tables, which takes most of the time."""
    monkeypatch.setattr(Examination, "outdated", lambda self, name: False)


@pytest.mark.usefixtures("not_made_again")
def test_missing_results_have_a_distinct_exit_code_and_name_the_command(results, subject, capsys):
    reference = folder_of(RESULTS) / "error_budget.csv"
    kept = reference.read_bytes()
    for path in (TABLE.at(RESULTS, name="stability"), f"{RESULTS}/figures/ladder.png", reference):
        Path(path).unlink()
    status, printed = verify_tables(subject), capsys.readouterr().out.splitlines()
    reference.write_bytes(kept)
    assert status == Status.MISSING
    assert not PAGE.exists()
    assert "table error_budget: no reference, to accept it, run verify --update" in printed
    for line, command in (
        ("table stability", "./reproduce --configfile config/tiny.yaml -- stability"),
        ("figure stability_map: not there", ""),
        ("figure ladder: not there, results/studies/tiny/figures/ladder.png", "./reproduce"),
    ):
        assert any(one.startswith(line) and command in one for one in printed), line


def test_the_exit_code_is_that_of_the_worst_outcome():
    """Each further outcome is worse than those before it."""
    order = "REPRODUCED", "NOT_COMPARABLE", "NO_REFERENCE", "DIFFERS", "MISSING"
    lines = [Line("table", "a", Outcome[name]) for name in order]
    assert [status_of(lines[:count]) for count in range(1, 6)] == [0, 0, 3, 3, 4]
    assert status_of([lines[0], lines[3]]) == Status.DIFFERS


def test_an_update_writes_every_table_and_notes_the_reason(results, subject, monkeypatch):
    monkeypatch.setattr("study.verification.command.faults", lambda *_: {})
    folder = folder_of(RESULTS)
    before = {path.name: path.read_bytes() for path in folder.glob("*.csv*")}
    (folder / "ladder.csv").unlink()
    (folder / "of_an_older_version.csv.xz").touch()
    assert [update(subject, why) for why in (" a new\n method ", "second")] == [folder] * 2
    assert re.search(r"\): a new method\n- .*\): second\n$", (folder / LOG).read_text("utf-8"))
    (folder / LOG).unlink()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_tables_that_a_run_would_make_again_are_not_expected(results, subject):
    """No job of this plan has written the present tables."""
    with pytest.raises(StorageError, match=r"results/.*: settings or code have changed; run"):
        update(subject, "a new method")
    assert not (folder_of(RESULTS) / LOG).exists()


# Table, its edit, and the line that must report the edit, if not that of the table. Edits of
# rows and columns: test_mutations.py.
EDITS = {
    "a column is left out": ("ladder", lambda f: f.drop(columns="gain")),
    "a column is new": ("ladder", lambda f: f.assign(better=True)),
    "a verdict is another one": (
        "claims",
        lambda f: f.assign(verdict=f.verdict.where(f.claim != "C5", "another")),
        "claim C5"),
    "a table gives another verdict": (
        "local_share",
        lambda f: f.assign(local_share=np.where(f.local_share.median() < 0.7, 0.9, 0.1)),
        "claim all"),
    "a speed-up of a derived table is larger": (
        "payoff", lambda f: f.assign(best_speedup=2 * f.best_speedup)),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_table_is_noticed(name, examination, monkeypatch):
    table, change, *place = EDITS[name]
    path = TABLE.at(RESULTS, name=table)
    write_table(change(read_table(path)), path)
    kind, line = (place or [f"table {table}"])[0].split(" ")
    if line == "C5":  # as if its tables gave this verdict
        monkeypatch.setattr(Examination, "outdated", lambda self, name: False)
    found = [examination.table("claims" if kind == "claim" else line)]
    found = examination.claims(*found) if kind == "claim" else found
    assert [one.outcome for one in found if one.name == line] == [Outcome.DIFFERS]


@pytest.mark.usefixtures("not_made_again")
def test_a_truncated_a_missing_and_an_invalid_table_are_noticed(examination):
    cut, lost, more = (TABLE.at(RESULTS, name=name) for name in ("ladder", "stability", "more"))
    content = Path(cut).read_bytes()
    with atomic_path(cut) as temporary:
        temporary.write_bytes(content[: len(content) // 2])
    Path(lost).unlink()
    write_table(pd.DataFrame({"x": [1.0]}), more)
    lines = {line.name: line.outcome for line in examination.lines() if line.kind == "table"}
    assert lines["ladder"] is lines["more"] is Outcome.DIFFERS
    assert lines["stability"] is Outcome.MISSING


def test_a_configuration_without_references_and_conflicting_options_are_refused(results, tmp_path):
    own = tmp_path / "other.yaml"
    own.write_text("ranks: [6]\n")
    with pytest.raises(ConfigurationError, match="no expected tables of this configuration"):
        verify(["--configfile", str(own)])
    for words in (["--no-such-option"], ["--update", "--files"]):
        with pytest.raises(SystemExit):
            verify(words)
