"""Changes beyond the tolerances are noticed; differences between machines are accepted."""

import re

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import read_table
from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES, Table, count, number, shared, text, timed
from study.tables.kit.results import OWN_ERRORS
from study.verification.compare import REDUCED_RUN, Comparison, Context, identities, read_references

COLUMNS = (
    *shared("scene group method r elements_sampled finite frames relative_error"),
    number("shape_error", "of the shape"),
    number("energy_drift", "energy", compared="error"),
    number("stiffness", "a well-conditioned number"),
    number("estimated_error", "a coarse estimate", tolerance=0.5),
    number("correlation", "a share", compared="share"),
    count("runs", "a number of runs"),
    text("outcome", "words of which a share may change", compared="error", tolerance=0.01),
    timed(text("verdict", "a verdict", compared="exact")),
    timed(number("ms", "a time", "ms")),
    number("residual", "a rounding error", compared="skipped"),
)
RUNS = Table("runs", "Runs", {}, {}, lambda: None, columns=COLUMNS)
SCENES = ("calm", "chaotic", "wrong", "amplified", "calm", "chaotic")


def runs():
    """Eight runs of each scene in `SCENES`; the last two have another method each."""
    rows = [
        {
            "scene": scene, "group": "all", "method": ("deim", "ecsw", "qdeim")[max(0, part - 3)],
            "r": r, "elements_sampled": 10 * r, "finite": True, "frames": 60,
            "relative_error": 0.3 if scene == "wrong" else 0.01, "shape_error": 0.02,
            "energy_drift": 0.2, "stiffness": 2.0, "estimated_error": 0.01,
            "correlation": 0.5, "runs": 9, "outcome": "good",
            "verdict": "holds", "ms": 1.0, "residual": 1e-15,
        }
        for part, scene in enumerate(SCENES)
        for r in range(1, 9)
    ]  # fmt: skip
    return RUNS.checked(pd.DataFrame(rows))


@pytest.fixture
def context():
    made = Context({})
    made.chaotic = ["chaotic"]
    made.gains = {("amplified", "all", "deim", str(r)): 1e3 for r in range(1, 9)}
    return made


def differences(found, context, expected=None):
    expected = runs() if expected is None else expected
    return Comparison(
        RUNS, expected, RUNS.checked(found.reset_index(drop=True)), context
    ).messages()


# Column, its changed row or rows (first:end), and factor or new value.
AGREE = """
relative_error 0 *1.000000000001 | stiffness 0 *1.000000000001 | stiffness 0 *1.00005
relative_error 0 *1.03 | relative_error 16 *1.2 | energy_drift 16 *1.2 | correlation 0 =0.55
runs 0 =11 | elements_sampled 39 =81 | r 39 =9 | outcome 6:9 ="bad" | ms 0:8 *9 | residual 0:8 *9
estimated_error 0:8 *1.4
relative_error 8 *6 | relative_error 24 *6 | finite 8 =False | finite 24 =False | frames 8 =3
shape_error 8 =nan | relative_error 8:16 *3 | stiffness 8:16 *1.1
"""
DIFFER = """
stiffness 0:8 *1.00005 | stiffness 0 *1.0002 | relative_error 0:8 *1.03 | relative_error 0 *1.1
relative_error 16 *1.5 | energy_drift 0 *1.2 | shape_error 16 *1.2 | relative_error 0 =inf
relative_error 0 =-inf | relative_error 0 =nan | relative_error 0 =0.0 | relative_error 0 =-0.01
estimated_error 0 *2.5
correlation 0 =0.65 | runs 0 =12 | finite 0 =False | finite 0:3 =None | frames 0 =59
elements_sampled 0 =11 | elements_sampled 39 =120 | r 7 =9 | outcome 6:10 ="bad" | verdict 8 ="no"
relative_error 8:16 *6 | relative_error 24:32 *6 | relative_error 8:16 =1e30 | finite 8:16 =False
relative_error 24:32 =nan | stiffness 24 *1.1
"""
CHANGES = [(text.strip(), text in DIFFER) for text in re.split(r"[|\n]", AGREE + DIFFER) if text]


@pytest.mark.parametrize(("change", "noticed"), CHANGES)
def test_a_change_is_a_difference_beyond_the_tolerance_or_count(change, noticed, context):
    column, rows, value = change.split()
    first, _, end = rows.partition(":")
    found = runs().astype(object)
    for row in range(int(first), int(end or int(first) + 1)):
        number = eval(value[1:], {"nan": np.nan, "inf": np.inf})
        found.loc[row, column] = number * found.loc[row, column] if value[0] == "*" else number
    texts = differences(found, context)
    assert bool(texts) == noticed, texts
    assert all(column in text for text in texts)


def test_rows_without_a_match_and_in_another_order_are_named(context):
    frame = runs()
    [missing] = differences(frame.drop(index=3), context)
    [added, *_] = differences(pd.concat([frame, frame.iloc[[5]]]), context)
    [moved] = differences(frame.iloc[[1, 0, *range(2, len(frame))]], context)
    assert re.match(r"row 4 \(scene calm, .*\): expected a row, found none$", missing)
    assert re.match(r"row 49 \(scene calm, .*\): expected none, found a row$", added)
    assert re.match(r"order of the rows: row 2 \(scene calm, ", moved)


def test_a_row_after_a_missing_one_keeps_its_number(context):
    found = runs().assign(stiffness=[*[2.0] * 5, 4.0, *[2.0] * 42]).drop(index=3)
    assert [text.split(" (")[0] for text in differences(found, context)] == ["row 4", "row 6"]


def test_a_diverged_run_may_be_missing_only_in_a_table_of_runs_with_an_error(context):
    table = declared()["accuracy_cost"]
    folder = ROOT / "results/reference/studies/tiny/tables"
    frame = read_references(folder)[table.name].frame
    diverged, other = frame.index[frame.method == "deim"][:2]
    context.diverged = [set(), {*identities(frame.loc[[diverged]], REDUCED_RUN)}]
    messages = [
        Comparison(table, frame, frame.drop(index=row), context).messages()
        for row in (diverged, other)
    ]
    assert list(map(len, messages)) == [0, 1]


def test_a_difference_is_named_with_row_column_and_both_values(context):
    [text] = differences(runs().assign(stiffness=[4.0, *[2.0] * 47]), context)
    assert text == (
        "row 1 (scene calm, group all, method deim, r 1, elements_sampled 10, stiffness 2), "
        "stiffness: expected 2, found 4 (off by 0.5, allowed 0.0001)"
    )


def test_no_tolerance_exceeds_a_factor_of_two():
    limits = {column.within for table in declared().values() for column in table.columns
              if column.kind == "number" and column.quantity in TOLERANCES}  # fmt: skip
    assert max(limits) <= 0.5


@pytest.mark.parametrize(
    "cell", ["1e400", "abc", "-7", "9" * 30, "no", "1_0", "\u0663", '"a\nb"', 'a"b', '"', "a\0b"]
)
@pytest.mark.parametrize("column", ["r", "finite", "relative_error"])
def test_any_content_of_a_cell_is_a_difference_or_an_error_in_one_line(
    column, cell, tmp_path, context
):
    path, rows = tmp_path / "table.csv", runs().astype(object)
    rows.loc[0, column] = "@"
    content = rows.to_csv(index=False, lineterminator="\n").replace("@", cell)
    path.write_text(content, newline="")
    try:
        found = differences(read_table(path, RUNS.column_names, result=False), context)
    except StorageError as error:
        found = [str(error)]
    assert found
    assert "\n" not in "".join(found)


def test_deformation_errors_are_errors_and_those_of_references_are_estimates():
    columns = [column for table in declared().values() for column in table.columns]
    known = [c for c in columns if "deformation" in c.name and not c.timed]
    assert {c.quantity for c in known} == {"error"}
    assert {c.within for c in columns if c.name in OWN_ERRORS} == {0.5}
