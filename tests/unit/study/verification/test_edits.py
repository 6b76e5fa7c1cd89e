"""Edits of tables, with new checksums, that a sceptic tries: each is noticed."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import atomic_path, read_table, write_table
from study.artifact.paths import TABLE
from study.verification.examine import Outcome

RESULTS = "results/studies/tiny"
RERUNS = "reduced_reruns"
ERRORS = ["relative_error", "relative_error_within_horizon", "error_over_extent", "shape_error"]


def put(frame, rows, columns, value):
    frame.loc[rows, columns] = value
    return frame


def of_runs(frame, failed):
    """Rows of runs that ended, and failed or did not."""
    error = frame.relative_error_within_horizon
    return frame.index[error > 0.1] if failed else frame.index[error <= 0.1]


def errors_times(frame, rows, factor, gains):
    frame.loc[rows, "gain"] *= gains
    frame.loc[rows, [name for name in frame if "error" in name]] *= factor
    return frame


def some_gains(frame):
    return frame.index[frame.gain.notna()][:: 5 * len(frame) // frame.gain.notna().sum()]


def failed_runs_become_blow_ups(frame):
    rows = of_runs(frame, True)
    put(frame, rows, ERRORS, np.nan)
    return put(frame, rows, ["frames", "blowup_frame", "finite"], [3, 3, False])


def blow_ups_on_bases_of_round_off_become_runs(frame):
    rows = frame.index[frame.finite == False]  # noqa: E712 : or empty
    assert len(rows)
    return put(frame, rows, ["finite", "relative_error"], [True, 0.01])


def swapped(frame, column):
    names = frame[column].unique()
    others = dict(zip(names, np.roll(names, 1), strict=True))
    return frame.assign(**{column: frame[column].map(others)})


def another(frame, row, column):
    now = frame.loc[row, column].iloc[0]
    return put(frame, row, column, "holds" if now != "holds" else "does not hold")


# Table, its edit, and the line in which it is to be noticed, where not that of the table. Numbers
# and outcomes of every column that move, and rows that are invented, doubled, deleted, renamed or
# swapped: test_judge.py.
EDITS = {
    "errors times thirty with other gains": (
        "reconstruction_error", lambda f: errors_times(f, some_gains(f), 30, 1 + 1e-5)),
    "errors twice as large with other gains": (
        "reconstruction_error", lambda f: errors_times(f, f.index[f.gain < 100][::10], 2, 1.3)),
    "a failed run is left out": (RERUNS, lambda f: f.drop(index=of_runs(f, True)[0])),
    "errors of failed runs become enormous": (
        RERUNS, lambda f: put(f, of_runs(f, True), ERRORS, 1e30)),
    "failed runs become blow-ups": (RERUNS, failed_runs_become_blow_ups),
    "a run does not end": (RERUNS, lambda f: put(f, of_runs(f, False)[0], "finite", False)),
    "blow-ups on bases of round-off become runs": (
        "noise", blow_ups_on_bases_of_round_off_become_runs),
    "runs on bases of round-off become wrong": (
        "noise", lambda f: put(f, f.relative_error.notna(), "relative_error", 0.5)),
    "an outcome has another name": (
        "stability", lambda f: put(f, f.index[f.outcome == "wrong"][0], "outcome", "accurate")),
    "all errors of held-out motions move a little": (
        RERUNS, lambda f: f.assign(
            shape_error=f.shape_error.where(f.motion == "train", f.shape_error * (1 + 1e-3)))),
    "a number is missing": ("singular_values", lambda f: put(f, 0, "singular_value", np.nan)),
    "a number is infinite": ("singular_values", lambda f: put(f, 0, "singular_value", np.inf)),
    "a number is a word": (
        "singular_values", lambda f: put(f.astype(object), 0, "singular_value", "large")),
    "a column is left out": ("ladder", lambda f: f.drop(columns="gain")),
    "a column has another name": ("ladder", lambda f: f.rename(columns={"gain": "gains"})),
    "a column is new": ("ladder", lambda f: f.assign(better=True)),
    "nothing is left": ("ladder", lambda f: f.head(0)),
    "splits are swapped": ("reconstruction_error", lambda f: swapped(f, "split")),
    "methods are swapped": (RERUNS, lambda f: swapped(f, "method")),
    "a verdict as published is another one": (
        "claims", lambda f: put(f, f.claim == "C5", "verdict", "holds"), "claim C5"),
    "a verdict beyond is another one": (
        "claims", lambda f: another(f, f.claim == "C11", "verdict_beyond"), "claim C11"),
    "a verdict stays where its tables give another one": (
        "local_share",
        lambda f: f.assign(local_share=np.where(f.local_share.median() < 0.7, 0.9, 0.1)),
        "claim C1"),
    "the reason of a verdict is another one": (
        "claims_tests", lambda f: put(f, 0, "satisfied", f.satisfied[0] + 1)),
    "a verdict under other rules is another one": (
        "claims_sensitivity", lambda f: another(f, [0], "verdict")),
    "a speed-up of a derived table is larger": (
        "payoff", lambda f: f.assign(best_speedup=2 * f.best_speedup)),
    "times move away from what was made of them": (
        "local_share", lambda f: f.assign(local_share=0.5 * f.local_share), "table claims_tests"),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_is_noticed(name, examination):
    table, change, *place = EDITS[name]
    path = TABLE.at(RESULTS, name=table)
    write_table(change(read_table(path)), path)
    kind, line = (place or [f"table {table}"])[0].split(" ")
    lines = examination.claims() if kind == "claim" else [examination.table(line)]
    [found] = [one for one in lines if one.name == line]
    assert found.outcome is Outcome.DIFFERS, found


def test_a_table_that_was_cut_one_that_is_lost_and_one_that_is_none_are_noticed(examination):
    cut, lost, more = (TABLE.at(RESULTS, name=name) for name in ("ladder", "stability", "more"))
    content = Path(cut).read_bytes()
    with atomic_path(cut) as temporary:
        temporary.write_bytes(content[: len(content) // 2])
    Path(lost).unlink()
    write_table(pd.DataFrame({"x": [1.0]}), more)
    lines = {line.name: line.outcome for line in examination.lines() if line.kind == "table"}
    assert lines["ladder"] is lines["more"] is Outcome.DIFFERS
    assert lines["stability"] is Outcome.MISSING
