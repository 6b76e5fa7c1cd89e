"""A number that moves by three times its tolerance is noticed; what rounding moves is not."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import read_table
from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import QUANTITIES, TALLY, TOLERANCES
from study.verification import compare
from study.verification.compare import Comparison, Context, judge, kept, names, names_row
from study.verification.references import read_references

FOLDERS = [ROOT / "results/reference/tables", ROOT / "results/reference/studies/tiny/tables"]
ROWS = 6
# of cells that rounding decides about, half may be off by more than a factor of two
TWO = 2.0
# smaller numbers are rounding errors
SMALL = 1e-9


@pytest.fixture(scope="module")
def studies():
    """Tracked tables of the full and of the tiny study, by name, each compared with itself."""
    found = []
    for folder in FOLDERS:
        tables = {name: reference.frame for name, reference in read_references(folder).items()}
        context = Context(tables)
        found.append({n: Comparison(declared()[n], t, t, context) for n, t in tables.items()})
    return found


@pytest.fixture(scope="module")
def tiny(studies):
    return studies[1]


def differences(alone, found, *only, expected=None, context=None):
    """What differs from a table, or ``expected`` rows of it; ``only`` in these columns and names.

    alone : the table compared with itself
    """
    table, expected = alone.table, alone.expected if expected is None else expected
    expected, found = (rows.reset_index(drop=True) for rows in (expected, found))
    found = table.checked(found)
    if only:
        own = [c for c in table.columns if c.quantity in ("exact", "value") or c.name in only]
        table = replace(table, columns=tuple(own))
    return judge(Comparison(table, expected, found, context or alone.context))[0]


def every_column(study, kinds):
    """Compared columns of some kinds, each with its table compared with itself."""
    for alone in study.values():
        yield from ((c, alone) for c in kept(alone.table).values() if c.kind in kinds)


def three_times(column, values, limit):
    if column.kind == "integer":
        return values + max(1, int(3 * limit * (1 if column.quantity == "share" else values.max())))
    return values + 3 * limit if column.quantity == "share" else values * (1 + 3 * limit)


def firm_and_loose(column, alone):
    """Rows with a number, those that are compared one by one and those by count."""
    numbers = alone.expected[column.name].to_numpy(dtype=float, na_value=np.nan)
    held = np.isfinite(numbers) & (column.quantity == "share") | (np.abs(numbers) > SMALL)
    held &= np.isfinite(numbers) & alone.compared(column)
    firm = alone.firm(column)
    return np.flatnonzero(held & firm), np.flatnonzero(held & ~firm)


def changed_rows(alone, cells):
    """Rows of a table, and the same with one cell of each column in ``cells`` changed."""
    rows = alone.expected.iloc[sorted({*cells.values()})]
    found = rows.astype({column.name: object for column in cells})
    for column, cell in cells.items():
        value, limit = rows.loc[[cell], column.name], float(alone.limits(column)[cell])
        found.loc[cell, column.name] = three_times(column, value, limit).iloc[0]
    return rows, found


def changed_cells(column, alone, cells):
    """Rows that are compared by count, of one scene where there are scenes; and others."""
    rows = alone.expected.iloc[cells]
    if "scene" in rows:
        rows = rows[rows.scene == rows.scene.value_counts().index[0]]
    factor = 3 * TWO if column.kind == "number" else 2
    return rows, rows.assign(**{column.name: rows[column.name] * factor})


def told(column, texts):
    """Whether one of the texts is of a difference in a column."""
    starts = f"{column} of ", f"{column}, as of ", f"{column}: "
    return any(text.startswith(starts) or f" {column}: expected" in text for text in texts)


def test_a_change_of_any_number_is_noticed(studies):
    """In the first study that has numbers to change; in the largest of those compared by count.

    Columns that name the rows are changed one by one, the others of a table at once. Few columns
    are compared by count alone, or hold nothing.
    """
    firm, loose, every, missed = set(), {}, set(), []
    for study in studies:
        for name, alone in study.items():
            chosen = {}
            for column in kept(alone.table).values():
                if column.kind in ("number", "integer") and (name, column.name) not in firm:
                    every.add((name, column.name))
                    cells, counted = firm_and_loose(column, alone)
                    if len(cells):
                        chosen[column] = int(cells[len(cells) // 2])
                    elif len(counted) > 1:  # one of them may have any outcome
                        changed = changed_cells(column, alone, counted)
                        loose.setdefault((name, column.name), []).append((alone, *changed))
            firm |= {(name, column.name) for column in chosen}
            named = [{column: cell} for column, cell in chosen.items() if names_row(column)]
            others = {column: cell for column, cell in chosen.items() if not names_row(column)}
            for cells in filter(None, (*named, others)):
                rows, found = changed_rows(alone, cells)
                texts = differences(alone, found, *(c.name for c in cells), expected=rows)
                seen = [c for c in cells if told(c.name, texts) or (names_row(c) and texts)]
                missed += [(name, column.name) for column in cells.keys() - set(seen)]
    assert missed == []
    # a column may hold nothing but rounding errors or one blow-up, or nothing at all
    for place in loose.keys() - firm:
        alone, rows, found = max(loose[place], key=lambda each: len(each[1]))
        assert differences(alone, found, place[1], expected=rows), place
    assert len(firm) > 0.85 * len(every), every - firm


def test_unchanged_tables_pass_and_most_cells_are_compared_one_by_one(studies):
    for study in studies:
        assert [name for name, alone in study.items() if judge(alone)[0]] == []
        columns = every_column(study, ("text", "flag", "number", "integer"))
        assert np.concatenate([alone.firm(column) for column, alone in columns]).mean() > 0.6


def test_no_tolerance_exceeds_a_factor_of_two():
    assert set(QUANTITIES) - set(TOLERANCES) == {"timed", "skipped"}
    for table in declared().values():
        for column in table.columns:
            assert column.within <= (TALLY if column.kind == "integer" else 0.5), column.name
    assert compare.FITTED <= 0.5


def test_a_run_on_amplified_samples_may_end_otherwise(tiny):
    """One of its scene and method; and tables that list no blow-ups do without it."""
    alone, dots = tiny["reduced_reruns"], tiny["accuracy_cost"]
    runs, points = alone.expected.copy(), dots.expected
    amplified = {key for key, gain in alone.context.gains.items() if gain > compare.OF_RUNS}
    row = next(i for i, key in enumerate(names(runs)) if key in amplified)
    runs.loc[row, ["relative_error", "relative_error_within_horizon"]] = np.nan
    runs.loc[row, ["finite", "blowup_frame"]] = [False, 3]
    assert not differences(alone, runs)
    same = np.array([key == names(runs, compare.RUN)[row] for key in names(points, compare.RUN)])
    assert same.any()
    assert differences(dots, points[~same])
    context = Context({name: each.expected for name, each in tiny.items()}, runs)
    assert not differences(dots, points[~same], context=context)


def test_a_fit_may_leave_an_element_more_and_no_other_selection_may(tiny):
    alone = tiny["scaling"]
    rows = alone.expected
    many = (rows.elements_sampled > 20).fillna(False).to_numpy(bool)
    row = int(np.flatnonzero(many & alone.fitted())[0])
    more = rows.assign(elements_sampled=rows.elements_sampled + (rows.index == row))
    assert not differences(alone, more)
    rows, more = (f.assign(method=f.method.str.replace("ecsw", "gappy")) for f in (rows, more))
    assert "elements_sampled" in str(differences(alone, more, expected=rows)[0])


def test_verdicts_that_rest_on_times_are_not_judged(tiny, monkeypatch):
    monkeypatch.chdir(ROOT)
    claims = tiny["claims"].expected
    for claim, noticed in (("C1", False), ("C5", True)):
        found = claims.assign(verdict=claims.verdict.mask(claims.claim == claim, "another one"))
        assert bool(differences(tiny["claims"], found)) == noticed


def test_messages_name_the_row_and_how_far_it_is_off(tiny):
    found = tiny["singular_values"].expected.copy()
    found.loc[found.singular_value.idxmax(), "singular_value"] *= 2
    text = differences(tiny["singular_values"], found)[0]
    assert text.startswith("scene ")
    assert text.endswith("(off by 0.5, allowed 0.0001)")


def moved(column, alone):
    """Cells of a column of which some move or have another outcome; how many do.

    Those that are compared one by one, of runs that are not wrong.
    """
    values, numbers = alone.expected[column.name], column.kind in ("number", "integer")
    rows = alone.firm(column) & ~alone.wrong(column) & alone.compared(column)
    if numbers:
        values = values.to_numpy(dtype=float, na_value=np.nan)
        other = 1.04 * values if column.kind == "number" else np.ceil(1.04 * values)
        rows &= np.isfinite(values) & (np.abs(values) > SMALL)
        least = 1 if column.tolerance is None else compare.LEAST
    else:
        rows &= values.notna().to_numpy() & (column.quantity == "error")
        other = ~values.fillna(False).astype(bool) if column.kind == "flag" else "another"
        least = 1
    return pd.Series(values).mask(rows, other), int(rows.sum()) if rows.sum() >= least else 0


def test_any_column_that_moves_by_four_per_cent_or_has_other_outcomes_is_noticed(tiny):
    """All columns of a table at once, but those that name its rows."""
    missed, tried = [], 0
    for alone in tiny.values():
        columns = {c.name: c for c in kept(alone.table).values() if not names_row(c)}
        other = {name: moved(column, alone) for name, column in columns.items()}
        counts = {name: count for name, (_, count) in other.items() if count}
        found = alone.expected.assign(**{name: other[name][0] for name in counts})
        texts = differences(alone, found)
        missed += [(alone.table.name, name) for name in counts if not told(name, texts)]
        tried += sum(columns[name].kind in ("number", "integer") for name in counts)
    assert tried > 60
    assert missed == []


def test_errors_of_one_method_scene_or_group_that_move_by_four_per_cent_are_noticed(studies):
    """By its name, also the one with the fewest rows; but for wrong runs and rows by count."""
    missed, tried = [], set()
    cases = [(each, name) for each in studies[1].values() for name in ("scene", "group", "method")]
    cases += [(studies[0][name], "method") for name in ("reduced_reruns", "accuracy_cost")]
    for alone, label in cases:
        own = [c for c in kept(alone.table).values() if (c.quantity, c.kind) == ("error", "number")]
        columns = [c.name for c in own]
        sound = [(alone.e[c.name] > 0) & alone.firm(c) & ~alone.wrong(c) for c in own]
        groups = alone.e.groupby(label).indices if label in alone.e else {}
        counts = {v: max((s[i].sum() for s in sound), default=0) for v, i in groups.items()}
        enough = sorted((n, value) for value, n in counts.items() if n >= compare.LEAST)
        for value in {value for _, value in enough[:1] + [e for e in enough if "ecsw" in e[1]]}:
            found = alone.expected.copy()
            found.loc[groups[value], columns] *= 1.04
            tried.add((alone.table.name, value))
            if f"{label} {value}" not in "".join(differences(alone, found, *columns)):
                missed.append((alone.table.name, label, value))
    assert missed == []
    assert {("accuracy_cost", "ecsw-1e-02"), ("reduced_reruns", "ecsw-1e-02")} <= tried


CELLS = (
    "inf", "1e400", "abc", "-7", "9" * 30, "True", "no", "1_0", "\u0663", "1.5", "0x1",
    '"a\nb"', 'a"b', '"', "a\0b", "1,2", "9223372036854775808",
)  # fmt: skip


def test_any_content_of_a_cell_is_a_difference_or_an_error_in_one_line(tiny, tmp_path, rng):
    """Of some compared columns of every table: it names the column, or a file that is no table."""
    path, missed = tmp_path / "table.csv", []
    for name, alone in tiny.items():
        columns = [*kept(alone.table).values()]
        for column in rng.choice(columns, min(4, len(columns)), replace=False):
            cell, row = str(rng.choice(CELLS)), int(rng.integers(min(4, len(alone.expected))))
            rows = alone.expected.head(4).astype(object)
            texts = [rows.to_csv(index=False, lineterminator="\n")]
            rows.loc[row, column.name] = "@"
            texts += [rows.to_csv(index=False, lineterminator="\n").replace("@", cell)]
            try:
                expected, found = (read(alone.table, path, text) for text in texts)
                said = "".join(differences(alone, found, expected=expected))
            except StorageError as error:
                said = str(error)
            told = column.name in said or "not a readable table" in said
            judged = alone.firm(column)[row] & alone.compared(column)[row]
            if "\n" in said or (judged and not told):
                missed.append((name, column.name, row, cell, said))
    assert missed == []


def read(table, path, text):
    path.write_text(text, newline="")
    return table.checked(read_table(path, table.column_names, result=False))


def test_rows_that_are_invented_doubled_deleted_swapped_or_renamed_are_noticed(tiny, rng):
    """The first of a large table; a renamed row is one that is deleted and one that is invented."""
    missed = []
    for name, alone in tiny.items():
        rows = alone.expected.head(100)
        row, last = int(rng.integers(len(rows))), len(rows) - 1
        word = next(name for name in rows if rows[name].dtype.kind not in "fiub")
        renamed = rows.astype({word: object})
        renamed.loc[row, word] = "another"
        edits = [
            (renamed, ("expected a row, found none", "expected none, found a row")),
            (pd.concat([rows, rows.iloc[[row]]]), ("expected none, found a row",)),
            (rows.iloc[[last, *range(1, last), 0]], ("order of the rows",) if last else ()),
        ]
        for found, said in edits:
            texts = "\n".join(differences(alone, found, "of the rows only", expected=rows))
            missed += [(name, words) for words in said if words not in texts]
    assert missed == []
