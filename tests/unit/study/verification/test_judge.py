"""A number that moves by three times its tolerance is noticed; what rounding moves is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import QUANTITIES, TALLY, TOLERANCES
from study.verification.compare import (
    FITTED,
    NOT_COMPARED,
    OF_RUNS,
    RUN,
    Comparison,
    Context,
    kept,
    names,
    names_row,
)
from study.verification.judge import LEAST, judge
from study.verification.references import read_reference

FOLDERS = [ROOT / "results/reference/tables", ROOT / "results/reference/studies/tiny/tables"]
ROWS = 6
# of cells that rounding decides about, half may be off by more than a factor of two
TWO = 2.0
# smaller numbers are rounding errors
SMALL = 1e-9


def read(folder: Path) -> tuple[dict, Context]:
    """Expected tables by name, and what they say of each other's rows."""
    references = {name: read_reference(table, folder) for name, table in declared().items()}
    tables = {name: found.frame for name, found in references.items() if found is not None}
    return tables, Context.of(tables)


@pytest.fixture(scope="module")
def studies():
    """Tracked tables of the full and of the tiny study."""
    return [read(folder) for folder in FOLDERS]


def side_by_side(table, context, expected, found):
    expected = expected.reset_index(drop=True)
    return Comparison(table, expected, table.checked(found.reset_index(drop=True)), context)


def three_times(column, values, limit):
    """Numbers that are off by three times a tolerance."""
    if column.kind == "integer":
        return values + max(1, int(3 * limit * (1 if column.quantity == "share" else values.max())))
    return values + 3 * limit if column.quantity == "share" else values * (1 + 3 * limit)


def firm_and_loose(table, column, context, frame):
    """Rows with a number, those that are compared one by one and those by count."""
    alone = Comparison(table, frame, frame, context)
    numbers = frame[column.name].to_numpy(dtype=float, na_value=np.nan)
    held = np.isfinite(numbers) & (column.quantity == "share") | (np.abs(numbers) > SMALL)
    held &= np.isfinite(numbers) & alone.compared(column)
    firm = alone.firm(column)
    return np.flatnonzero(held & firm), np.flatnonzero(held & ~firm)


def changed_cell(table, column, context, frame, cell):
    """A few rows with one cell changed."""
    rows = frame.iloc[max(0, cell - ROWS // 2) : cell + ROWS // 2]
    limit = float(Comparison(table, frame, frame, context).limits(column)[cell])
    found = rows.copy()
    value = frame[column.name].iloc[[cell]]
    found[column.name] = found[column.name].astype(object)
    found.loc[frame.index[cell], column.name] = three_times(column, value, limit).iloc[0]
    return side_by_side(table, context, rows, found)


def changed_cells(table, column, context, frame, cells):
    """All cells changed that are compared by count, of one scene where there are scenes."""
    rows = frame.iloc[cells]
    if "scene" in rows:
        rows = rows[rows.scene == rows.scene.value_counts().index[0]]
    found = rows.copy()
    factor = 3 * TWO if column.kind == "number" else 2
    found[column.name] = rows[column.name] * factor
    return side_by_side(table, context, rows, found)


def mutation(table, column, studies):
    """A comparison with a change of a column in the first study that has numbers to change."""
    loose = []
    for tables, context in studies:
        if table.name not in tables:
            continue
        frame = tables[table.name]
        firm, counted = firm_and_loose(table, column, context, frame)
        if len(firm):
            return changed_cell(table, column, context, frame, int(firm[len(firm) // 2]))
        # one of them may have any outcome
        if len(counted) > 1:
            loose.append(changed_cells(table, column, context, frame, counted))
    return max(loose, key=lambda comparison: len(comparison.e), default=None)


@pytest.mark.parametrize("name", declared())
def test_a_change_of_any_number_is_noticed(name, studies):
    table = declared()[name]
    for column in table.columns:
        if column.kind in ("number", "integer") and column.quantity not in NOT_COMPARED:
            comparison = mutation(table, column, studies)
            # a column may hold nothing but rounding errors or one blow-up, or nothing at all
            if comparison is not None:
                assert judge(comparison).differences, column.name


def test_few_columns_are_compared_by_count_alone_or_hold_nothing(studies):
    """Else the test above would say little."""
    others = {}
    for table in declared().values():
        for column in table.columns:
            if column.kind in ("number", "integer") and column.quantity not in NOT_COMPARED:
                frames = [(t[table.name], c) for t, c in studies if table.name in t]
                rows = [firm_and_loose(table, column, c, f) for f, c in frames]
                others[table.name, column.name] = not any(len(firm) for firm, _ in rows)
    assert np.mean(list(others.values())) < 0.15, [key for key, other in others.items() if other]


def test_most_cells_are_compared_one_by_one(studies):
    for tables, context in studies:
        loose = total = 0
        for name, frame in tables.items():
            alone = Comparison(declared()[name], frame, frame, context)
            for column in kept(alone.table).values():
                loose, total = loose + int((~alone.firm(column)).sum()), total + len(frame)
        assert loose < 0.4 * total


def test_unchanged_tables_pass(studies):
    for tables, context in studies:
        for name, frame in tables.items():
            assert judge(Comparison(declared()[name], frame, frame, context)).differences == ()


def test_no_tolerance_exceeds_a_factor_of_two():
    assert set(TOLERANCES) | set(NOT_COMPARED) == set(QUANTITIES)
    for table in declared().values():
        for column in table.columns:
            assert column.within <= (TALLY if column.kind == "integer" else 0.5), column.name
    assert FITTED <= 0.5


@pytest.fixture(scope="module")
def tiny(studies):
    """Tables of the tiny study and what they say of each other."""
    return studies[1]


def judged(tables, context, name, found):
    return judge(Comparison(declared()[name], tables[name], found, context)).differences


def test_a_run_on_amplified_samples_may_end_otherwise(tiny):
    """One of its scene and method; and tables that list no blow-ups do without it."""
    tables, context = tiny
    runs = tables["reduced_reruns"].copy()
    amplified = {key for key, gain in context.gains.items() if gain > OF_RUNS}
    row = next(i for i, key in enumerate(names(runs)) if key in amplified)
    runs.loc[row, ["relative_error", "relative_error_within_horizon"]] = np.nan
    runs.loc[row, ["finite", "blowup_frame"]] = [False, 3]
    assert not judged(tables, context, "reduced_reruns", runs)
    points = tables["accuracy_cost"]
    same = np.array([key == names(runs, RUN)[row] for key in names(points, RUN)])
    assert same.any()
    assert judged(tables, context, "accuracy_cost", points[~same])
    known = Context.of(tables, runs)
    assert not judged(tables, known, "accuracy_cost", points[~same])


def test_a_fit_may_leave_an_element_more_and_no_other_selection_may(tiny):
    tables, context = tiny
    rows = tables["scaling"]
    alone = Comparison(declared()["scaling"], rows, rows, context)
    fitted = alone.fitted() & (rows.elements_sampled > 20).fillna(False).to_numpy(bool)
    row = int(np.flatnonzero(fitted)[0])
    more = rows.assign(elements_sampled=rows.elements_sampled + (rows.index == row))
    assert not judged(tables, context, "scaling", more)
    other = {"scaling": rows.assign(method=rows.method.str.replace("ecsw", "gappy"))}
    found = more.assign(method=other["scaling"].method)
    assert "elements_sampled" in str(judged(other, context, "scaling", found)[0])


def test_verdicts_that_rest_on_times_are_not_judged(tiny, monkeypatch):
    monkeypatch.chdir(ROOT)
    tables, context = tiny
    claims = tables["claims"]
    for column, claim, noticed in (("verdict", "C1", False), ("verdict", "C5", True)):
        found = claims.copy()
        found.loc[found.claim == claim, column] = "another one"
        assert bool(judged(tables, context, "claims", found)) == noticed


def test_messages_name_the_row_and_how_far_it_is_off(tiny):
    tables, context = tiny
    found = tables["singular_values"].copy()
    found.loc[found.singular_value.idxmax(), "singular_value"] *= 2
    text = str(judged(tables, context, "singular_values", found)[0])
    assert text.startswith("scene ")
    assert text.endswith("(off by 0.5, allowed 0.0001)")


def good(comparison, column):
    """Rows in which rounding decides nothing about the cells of ``column``, and no run is wrong."""
    return comparison.firm(column) & ~comparison.wrong(column) & comparison.compared(column)


def noticed(table, context, expected, found):
    return judge(Comparison(table, expected, table.checked(found), context)).differences != ()


def every_column(tables, context):
    for name, frame in tables.items():
        alone = Comparison(declared()[name], frame, frame, context)
        for column in kept(alone.table).values():
            yield declared()[name], column, frame, alone


def test_any_column_of_numbers_that_moves_by_four_per_cent_is_noticed(tiny):
    missed, tried, (tables, context) = [], 0, tiny
    for table, column, frame, alone in every_column(tables, context):
        if column.kind not in ("number", "integer"):
            continue
        values = frame[column.name].to_numpy(dtype=float, na_value=np.nan)
        moved = 1.04 * values if column.kind == "number" else np.ceil(1.04 * values)
        rows = good(alone, column) & np.isfinite(values) & (np.abs(values) > SMALL)
        if rows.sum() < (1 if column.tolerance is None else LEAST):
            continue
        tried += 1
        found = frame.assign(**{column.name: np.where(rows, moved, values)})
        read = [
            c for c in table.columns if names_row(c) or c.quantity == "value" or "error" in c.name
        ]
        alone = replace(table, columns=tuple(dict.fromkeys([*read, column])))
        if not noticed(alone, context, frame, found):
            missed.append((table.name, column.name, int(rows.sum())))
    assert tried > 100
    assert missed == []


def test_any_column_of_outcomes_that_changes_is_noticed(tiny):
    missed, (tables, context) = [], tiny
    for table, column, frame, alone in every_column(tables, context):
        if column.kind not in ("text", "flag") or column.quantity != "error":
            continue
        rows = good(alone, column) & frame[column.name].notna().to_numpy()
        values = frame[column.name]
        other = ~values.fillna(False).astype(bool) if column.kind == "flag" else "another"
        if rows.any() and not noticed(
            table, context, frame, frame.assign(**{column.name: values.mask(rows, other)})
        ):
            missed.append((table.name, column.name, int(rows.sum())))
    assert missed == []


def edited_rows(frame, row):
    """Edits of one row: invented, doubled, deleted, swapped with another, renamed."""
    last = len(frame) - 1
    renamed = frame.copy()
    word = next(name for name in frame if frame[name].dtype.kind not in "fiub")
    renamed[word] = renamed[word].astype(object)
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
            if not noticed(declared()[name], context, frame, found.reset_index(drop=True)):
                missed.append((name, edit))
    assert missed == []


def test_runs_that_a_table_leaves_out_for_want_of_an_error_are_no_difference(tiny):
    tables, context = tiny
    table, frame = declared()["accuracy_cost"], tables["accuracy_cost"]
    first = frame[frame.group.notna()].index[:1]
    ended = replace(context, ended=(frozenset(), frozenset(names(frame.loc[first], RUN))))
    assert noticed(table, context, frame, frame.drop(index=first).reset_index(drop=True))
    assert not noticed(table, ended, frame, frame.drop(index=first).reset_index(drop=True))
