"""The cells behind a number of the manuscript, as the command shows them."""

import json

import pytest

from builders import frame
from pdrom.core.errors import PdromError
from pdrom.core.store import write_table, write_text
from study.verification.number import number

ENTRIES = "worst: {table: runs, rows: {method: pod}, column: error, take: max}\n"
MADE = {"text": "0.50", "value": 0.5, "table": "runs", "rows": [0, 2], "column": "error"}


@pytest.fixture
def last_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("default", "own"):
        write_text("scenes: []\n", tmp_path / f"config/{name}.yaml")
    write_text(ENTRIES, tmp_path / "paper/numbers.yaml")
    numbers = {"numbers": {"worst": {**MADE, "take": "max"}}}
    results = tmp_path / "results/studies/own"
    write_text(json.dumps(numbers), results / "paper/numbers.json")
    runs = frame("method error r", ("pod", 0.25, 1), ("deim", 9.0, 1), ("pod", 0.5, 2))
    write_table(runs, results / "tables/runs.csv")


def test_the_command_shows_the_rows_of_a_number(last_run, capsys):
    number(["--configfile", "config/own.yaml", "--", "worst"])
    said = capsys.readouterr().out
    assert "worst: 0.50 (unrounded: 0.5)" in said
    assert "max of 2 rows" in said
    rows = [line.split() for line in said.splitlines()[-2:]]
    assert rows == [["1", "pod", "0.25"], ["3", "pod", "0.50"]]


def test_an_unknown_number_is_named(last_run):
    with pytest.raises(PdromError, match=r"no number 'wrst'.*'worst'"):
        number(["--configfile", "config/own.yaml", "--", "wrst"])
