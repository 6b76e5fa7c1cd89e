"""A number that moves by three times its tolerance is noticed; what rounding moves is not."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import QUANTITIES, TALLY, TOLERANCES
from study.verification import compare
from study.verification.compare import LEAST, RUN, Comparison, Context, judge, kept, names
from study.verification.references import read_references

FOLDERS = [ROOT / "results/reference/tables", ROOT / "results/reference/studies/tiny/tables"]
ROWS = 6
# of cells that rounding decides about, half may be off by more than a factor of two
TWO = 2.0
# smaller numbers are rounding errors
SMALL = 1e-9


@pytest.fixture(scope="module")
def studies():
    """Tracked tables of the full and of the tiny study, and what they say of each other's rows."""
    found = []
    for folder in FOLDERS:
        tables = {name: reference.frame for name, reference in read_references(folder).items()}
        found.append((tables, Context(tables)))
    return found


@pytest.fixture(scope="module")
def tiny(studies):
    return studies[1]


def differences(table, context, expected, found, *only):
    """What differs between rows, counted anew; ``only`` in these columns and in the rows' names."""
    expected, found = (rows.reset_index(drop=True) for rows in (expected, found))
    found = table.checked(found)
    if only:
        own = [c for c in table.columns if c.quantity in ("exact", "value") or c.name in only]
        table = replace(table, columns=tuple(own))
    return judge(Comparison(table, expected, found, context))[0]


def every_column(tables, context, kinds):
    """Compared columns of some kinds with their table, and that beside itself."""
    for name, frame in tables.items():
        alone = Comparison(declared()[name], frame, frame, context)
        for column in kept(alone.table).values():
            if column.kind in kinds:
                yield column, frame, alone


def three_times(column, values, limit):
    if column.kind == "integer":
        return values + max(1, int(3 * limit * (1 if column.quantity == "share" else values.max())))
    return values + 3 * limit if column.quantity == "share" else values * (1 + 3 * limit)


def firm_and_loose(column, frame, alone):
    """Rows with a number, those that are compared one by one and those by count."""
    numbers = frame[column.name].to_numpy(dtype=float, na_value=np.nan)
    held = np.isfinite(numbers) & (column.quantity == "share") | (np.abs(numbers) > SMALL)
    held &= np.isfinite(numbers) & alone.compared(column)
    firm = alone.firm(column)
    return np.flatnonzero(held & firm), np.flatnonzero(held & ~firm)


def changed_cell(column, frame, alone, cell):
    """A few rows, and the same with one cell changed."""
    rows = frame.iloc[max(0, cell - ROWS // 2) : cell + ROWS // 2]
    limit = float(alone.limits(column)[cell])
    found = rows.astype({column.name: object})
    value = frame[column.name].iloc[[cell]]
    found.loc[frame.index[cell], column.name] = three_times(column, value, limit).iloc[0]
    return rows, found


def changed_cells(column, frame, cells):
    """Rows that are compared by count, of one scene where there are scenes; and others."""
    rows = frame.iloc[cells]
    if "scene" in rows:
        rows = rows[rows.scene == rows.scene.value_counts().index[0]]
    factor = 3 * TWO if column.kind == "number" else 2
    return rows, rows.assign(**{column.name: rows[column.name] * factor})


def test_a_change_of_any_number_is_noticed(studies):
    """In the first study that has numbers to change; in the largest of those compared by count.

    Few columns are compared by count alone, or hold nothing.
    """
    firm, loose, every = {}, {}, set()
    for tables, context in studies:
        for column, frame, alone in every_column(tables, context, ("number", "integer")):
            place = alone.table.name, column.name
            every.add(place)
            cells, counted = firm_and_loose(column, frame, alone)
            if len(cells):
                changed = changed_cell(column, frame, alone, int(cells[len(cells) // 2]))
                firm.setdefault(place, (context, *changed))
            elif len(counted) > 1:  # one of them may have any outcome
                loose.setdefault(place, []).append(
                    (context, *changed_cells(column, frame, counted))
                )
    # a column may hold nothing but rounding errors or one blow-up, or nothing at all
    largest = {place: max(found, key=lambda each: len(each[1])) for place, found in loose.items()}
    for (name, column), (context, rows, found) in {**largest, **firm}.items():
        assert differences(declared()[name], context, rows, found, column), (name, column)
    assert len(firm) > 0.85 * len(every), every - firm.keys()


def test_unchanged_tables_pass_and_most_cells_are_compared_one_by_one(studies):
    for tables, context in studies:
        for name, frame in tables.items():
            assert differences(declared()[name], context, frame, frame) == []
        columns = every_column(tables, context, ("text", "flag", "number", "integer"))
        assert np.concatenate([alone.firm(column) for column, _, alone in columns]).mean() > 0.6


def test_no_tolerance_exceeds_a_factor_of_two():
    assert set(QUANTITIES) - set(TOLERANCES) == {"timed", "skipped"}
    for table in declared().values():
        for column in table.columns:
            assert column.within <= (TALLY if column.kind == "integer" else 0.5), column.name
    assert compare.FITTED <= 0.5


def test_a_run_on_amplified_samples_may_end_otherwise(tiny):
    """One of its scene and method; and tables that list no blow-ups do without it."""
    tables, context = tiny
    runs = tables["reduced_reruns"].copy()
    amplified = {key for key, gain in context.gains.items() if gain > compare.OF_RUNS}
    row = next(i for i, key in enumerate(names(runs)) if key in amplified)
    runs.loc[row, ["relative_error", "relative_error_within_horizon"]] = np.nan
    runs.loc[row, ["finite", "blowup_frame"]] = [False, 3]
    table = declared()["reduced_reruns"]
    assert not differences(table, context, tables["reduced_reruns"], runs)
    table, points = declared()["accuracy_cost"], tables["accuracy_cost"]
    same = np.array([key == names(runs, RUN)[row] for key in names(points, RUN)])
    assert same.any()
    assert differences(table, context, points, points[~same])
    assert not differences(table, Context(tables, runs), points, points[~same])


def test_a_fit_may_leave_an_element_more_and_no_other_selection_may(tiny):
    tables, context = tiny
    table, rows = declared()["scaling"], tables["scaling"]
    many = (rows.elements_sampled > 20).fillna(False).to_numpy(bool)
    row = int(np.flatnonzero(many & Comparison(table, rows, rows, context).fitted())[0])
    more = rows.assign(elements_sampled=rows.elements_sampled + (rows.index == row))
    assert not differences(table, context, rows, more)
    others = [f.assign(method=rows.method.str.replace("ecsw", "gappy")) for f in (rows, more)]
    assert "elements_sampled" in str(differences(table, context, *others)[0])


def test_verdicts_that_rest_on_times_are_not_judged(tiny, monkeypatch):
    monkeypatch.chdir(ROOT)
    tables, context = tiny
    claims = tables["claims"]
    for claim, noticed in (("C1", False), ("C5", True)):
        found = claims.assign(verdict=claims.verdict.mask(claims.claim == claim, "another one"))
        assert bool(differences(declared()["claims"], context, claims, found)) == noticed


def test_messages_name_the_row_and_how_far_it_is_off(tiny):
    tables, context = tiny
    rows = tables["singular_values"]
    found = rows.copy()
    found.loc[found.singular_value.idxmax(), "singular_value"] *= 2
    text = differences(declared()["singular_values"], context, rows, found)[0]
    assert text.startswith("scene ")
    assert text.endswith("(off by 0.5, allowed 0.0001)")


def test_any_column_that_moves_by_four_per_cent_or_has_other_outcomes_is_noticed(tiny):
    """In cells about which rounding decides nothing, of runs that are not wrong."""
    missed, tried, (tables, context) = [], 0, tiny
    for column, frame, alone in every_column(
        tables, context, ("number", "integer", "text", "flag")
    ):
        values, numbers = frame[column.name], column.kind in ("number", "integer")
        rows = alone.firm(column) & ~alone.wrong(column) & alone.compared(column)
        if numbers:
            values = values.to_numpy(dtype=float, na_value=np.nan)
            other = 1.04 * values if column.kind == "number" else np.ceil(1.04 * values)
            rows &= np.isfinite(values) & (np.abs(values) > SMALL)
            if rows.sum() < (1 if column.tolerance is None else LEAST):
                continue
        else:
            rows &= values.notna().to_numpy()
            other = ~values.fillna(False).astype(bool) if column.kind == "flag" else "another"
            if column.quantity != "error" or not rows.any():
                continue
        tried += numbers
        found = frame.assign(**{column.name: pd.Series(values).mask(rows, other)})
        if not differences(alone.table, context, frame, found, column.name):
            missed.append((alone.table.name, column.name, int(rows.sum())))
    assert tried > 100
    assert missed == []


def edited_rows(frame, row):
    """Edits of one row: invented, doubled, deleted, swapped with another, renamed."""
    last = len(frame) - 1
    word = next(name for name in frame if frame[name].dtype.kind not in "fiub")
    renamed = frame.astype({word: object})
    renamed.loc[row, word] = "another"
    yield "invented", pd.concat([frame, renamed.iloc[[row]]])
    yield "doubled", pd.concat([frame, frame.iloc[[row]]])
    yield "deleted", frame.drop(index=row)
    yield "renamed", renamed
    if len(frame) > 1:
        order = np.arange(len(frame))
        order[[0, last]] = last, 0
        yield "swapped", frame.iloc[order]


def test_rows_that_are_invented_doubled_deleted_swapped_or_renamed_are_noticed(tiny, rng):
    missed, (tables, context) = [], tiny
    for name, frame in tables.items():
        for edit, found in edited_rows(frame, int(rng.integers(len(frame)))):
            if not differences(declared()[name], context, frame, found, "of the rows only"):
                missed.append((name, edit))
    assert missed == []
