"""A change of one cell of any table is noticed; what rounding may change is not."""

import math

import numpy as np
import pandas as pd
import pytest

from pdrom.pipeline.tables import all_tables
from pdrom.verification.compare import Comparison
from pdrom.verification.judge import judge
from pdrom.verification.references import NOT_KEPT
from pdrom.verification.rows import FITTED, of_fitted_samples
from pdrom.verification.spread import AS_A_WHOLE, COMPARED, OTHER, WHOLE

ROWS = 6


def judged(comparison, found, tolerances, settings, rows=None):
    """Judgement when something else was found, of some rows if they are given."""
    expected = comparison.expected if rows is None else rows
    made = Comparison(comparison.table, expected, found, comparison.context)
    return judge(made, tolerances, settings.anew)


def changed(column, values, cell, tolerances):
    """Values of a column with one cell changed by more than its tolerance.

    All cells of a column that is judged as a whole.
    """
    other = values.astype(object).copy()
    value = values.iloc[cell]
    if column.quantity == "ratio":
        factor = 2 * tolerances["ratio", OTHER].every + 2
        return (values.astype(float) * factor).astype(values.dtype)
    if column.quantity == "fragile":
        other[:] = "something else" if column.kind == "text" else True
        other[values == True] = False  # noqa: E712 : a column of flags
        return other
    if column.kind == "text":
        other.iloc[cell] = f"{value}!"
    elif column.kind == "flag":
        other.iloc[cell] = not value
    elif column.quantity in ("exact", "verdict", "count"):
        other.iloc[cell] = value + 1
    else:
        limit = max(tolerances[column.quantity, rows].every for rows in (OTHER, WHOLE))
        step = math.ceil(3 * limit) if column.kind == "integer" else 3 * limit * max(1, abs(value))
        other.iloc[cell] = (
            value * (3 * limit + 2) if column.quantity == "magnitude" else value + step
        )
    return other


def cell_to_change(comparison, column):
    """A cell that is compared and holds something, well inside the table."""
    held = ~comparison.free(column) & comparison.e[column.name].notna().to_numpy()
    if column.quantity == "count":
        held &= ~of_fitted_samples(comparison.e)
    if column.kind == "number":
        held &= np.isfinite(comparison.e[column.name].to_numpy(dtype=float, na_value=np.nan))
    if column.quantity == "magnitude":
        held &= (comparison.e[column.name] > 1e-12).to_numpy(dtype=bool)
    cells = np.flatnonzero(held)
    return int(cells[len(cells) // 2]) if len(cells) else None


def test_unchanged_tables_pass(unchanged, tolerances, settings):
    for comparison in unchanged.values():
        assert judge(comparison, tolerances, settings.anew).differences == ()


@pytest.mark.parametrize("name", all_tables())
def test_a_change_of_one_cell_is_noticed(name, unchanged, tolerances, settings):
    """In a column of each quantity and type that the table has: those are judged by the same rules.

    In the tiny study a few columns hold failed runs only, or nothing: another one is taken.
    """
    if name not in unchanged:
        pytest.skip("a new table: run verify --update on the tiny study")
    whole = unchanged[name]
    kept = [c for c in whole.table.columns if c.quantity not in NOT_KEPT]
    chosen = {}
    for column in kept:
        if (column.quantity, column.kind) not in chosen:
            cell = cell_to_change(whole, column)
            if cell is not None:
                chosen[column.quantity, column.kind] = column, cell
    for column, cell in chosen.values():
        rows = whole.e.iloc[max(0, cell - ROWS // 2) : cell + ROWS // 2].reset_index(drop=True)
        values = changed(column, rows[column.name], min(cell, ROWS // 2), tolerances)
        found = whole.table.checked(rows.assign(**{column.name: values}))
        assert judged(whole, found, tolerances, settings, rows).differences, column.name
    assert len(chosen) > len({(c.quantity, c.kind) for c in kept}) / 2 or not len(whole.e)


def test_a_row_less_and_a_row_more_are_noticed(unchanged, tolerances, settings):
    part = unchanged["singular_values"]
    less = part.expected.drop(index=3)
    assert "found none" in str(judged(part, less, tolerances, settings).differences[0])
    more = pd.concat([part.expected, part.expected.tail(1).assign(component=999)])
    words = str(judged(part, more, tolerances, settings).differences[0])
    assert "component 999" in words
    assert "expected none" in words


def test_a_fit_may_leave_an_element_more_and_no_other_selection_may(
    unchanged, tolerances, settings
):
    whole = unchanged["scaling"]
    rows = whole.expected
    fitted = of_fitted_samples(rows) & (rows.elements_sampled > 20).fillna(False).to_numpy(
        dtype=bool
    )
    assert fitted.any()
    one = int(np.flatnonzero(fitted)[0])
    assert not judged(whole, counted(rows, one, 1), tolerances, settings).differences
    many = counted(rows, one, int(rows.elements_sampled[one]))
    assert judged(whole, many, tolerances, settings).differences
    other = rows.assign(method=rows.method.str.replace(FITTED, "gappy"))
    more = judged(whole, counted(other, one, 1), tolerances, settings, other).differences
    assert "elements_sampled" in str(more[0])


def counted(rows, row, more):
    """Rows with a sampled element more in one of them."""
    changed = rows.elements_sampled.copy()
    changed[row] += more
    return rows.assign(elements_sampled=changed)


@pytest.fixture
def failed_run(unchanged):
    """Row of a failed run in the table of runs."""
    comparison = unchanged["reduced_reruns"]
    errors = comparison.expected.relative_error_within_horizon
    return comparison, int(errors[errors > 1.0].index[0])


def with_error(frame, row, error):
    columns = ["relative_error_within_horizon", "relative_error", "error_over_extent"]
    found = frame.copy()
    found.loc[row, columns] = error
    return found


def test_numbers_of_a_failed_run_may_move(failed_run, tolerances, settings):
    comparison, row = failed_run
    found = with_error(comparison.expected, row, 7.7).assign()
    found.loc[row, "max_extent"] = 999.0
    found.loc[row, ["finite", "blowup_frame"]] = [False, 12]
    assert judged(comparison, found, tolerances, settings).differences == ()


def test_a_failed_run_may_not_become_an_accurate_one(failed_run, tolerances, settings):
    comparison, row = failed_run
    found = with_error(comparison.expected, row, 0.01)
    assert judged(comparison, found, tolerances, settings).differences


def test_samples_chosen_anew_are_excused_if_the_errors_moved_with_them(
    unchanged, tolerances, settings
):
    comparison = unchanged["reconstruction_error"]
    frame = comparison.expected
    sampled = (frame.method == "block-deim") & (frame.r == 6) & frame.gain.notna()
    row = int(frame[sampled & (frame.relative_error < 0.05)].index[0])
    moved = frame.copy()
    moved.loc[row, "gain"] *= 1.3
    assert judged(comparison, moved, tolerances, settings).differences
    moved.loc[row, "relative_error"] *= 1.2
    judgement = judged(comparison, moved, tolerances, settings)
    assert judgement.differences == ()
    assert judgement.left_out["samples chosen anew"] > 0


def test_samples_of_many_rows_are_not_excused(unchanged, tolerances, settings):
    comparison = unchanged["reconstruction_error"]
    moved = comparison.expected.copy()
    moved["gain"] *= 1.3
    moved["relative_error"] *= 1.2
    words = " ".join(map(str, judged(comparison, moved, tolerances, settings).differences))
    assert "rows whose samples were chosen anew" in words


def test_a_small_shift_of_a_whole_column_is_noticed(unchanged, tolerances, settings):
    comparison = unchanged["heldout_reruns"]
    shift = 1 + 0.3 * tolerances["error", OTHER].every
    moved = comparison.expected.assign(shape_error=comparison.expected.shape_error * shift)
    words = str(judged(comparison, moved, tolerances, settings).differences[0])
    assert "nine of ten cells" in words


def test_every_quantity_of_the_tables_has_a_tolerance_or_none(tolerances):
    held = {c.quantity for table in all_tables().values() for c in table.columns}
    assert held <= {*COMPARED, *NOT_KEPT, "exact", "verdict"}
    assert set(AS_A_WHOLE) < set(COMPARED)
    assert {quantity for quantity, _ in tolerances} == set(COMPARED)


def test_well_conditioned_numbers_are_held_to_a_millionth(tolerances):
    assert tolerances["value", OTHER].every == 1e-6
    assert tolerances["gain", OTHER].every <= 1e-5
    assert tolerances["error", OTHER].nine <= 1e-5
