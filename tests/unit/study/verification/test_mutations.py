"""Mutations of the expected tables of both studies are noticed in every table and column."""

import re

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import WORDS
from study.verification.compare import Comparison, Context, identifies, kept, read_references

FOLDERS = {"full": "results/reference/tables", "tiny": "results/reference/studies/tiny/tables"}
ROWS = 60  # about as many rows of each table are compared


@pytest.fixture(scope="module", params=FOLDERS)
def expected(request):
    """Comparison of each expected table with itself."""
    read = read_references(ROOT / FOLDERS[request.param])
    context = Context({name: reference.frame for name, reference in read.items()})
    frames = [(declared()[name], ref.frame) for name, ref in read.items() if len(ref.frame)]
    parts = [(table, f.iloc[:: 1 + len(f) // ROWS].reset_index(drop=True)) for table, f in frames]
    return [Comparison(table, part, part, context) for table, part in parts]


def messages(good, frame):
    found = good.table.checked(frame.reset_index(drop=True))
    return Comparison(good.table, good.e, found, good.context).messages()


def test_expected_tables_agree_with_themselves_and_most_of_their_cells_are_stable(expected):
    assert [text for good in expected for text in good.messages()] == []
    unstable = [good.unstable(column) for good in expected for column in kept(good.table)]
    assert np.concatenate(unstable).mean() < 0.4


def judged(good, column):
    """Whether the column has enough cells, mostly numbers other than estimates or small counts."""
    cells = good.e[column.name]
    if column.kind in WORDS:
        return cells.notna().sum() > max(3, len(cells) / 3)
    stable = (cells.fillna(0) != 0) & ~good.unstable(column)
    return column.quantity in ("value", "error") and column.within < 0.5 and stable.sum() > 3


CHANGES = {
    "larger": (["number"], lambda cells: cells * 1.04),
    "other": (WORDS, lambda cells: ~cells if cells.dtype == "boolean" else cells + "!"),
    "empty": (["number", *WORDS], lambda cells: cells.mask(cells.notna())),
}


@pytest.mark.parametrize("change", CHANGES)
def test_columns_of_larger_numbers_other_words_and_empty_cells_are_noticed(change, expected):
    (kinds, edit), lost = CHANGES[change], []
    for good in expected:
        columns = [c for c in kept(good.table) if c.kind in kinds and not identifies(c)]
        cells = {c.name: edit(good.e[c.name]) for c in columns if judged(good, c)}
        text = "\n".join(messages(good, good.e.assign(**cells)))
        named = r"(^|, )(%s)(:| of| differs)"
        lost += [(good.table.name, c) for c in cells if not re.search(named % c, text, re.M)]
    assert lost == []


def test_changed_labels_and_parameters_are_noticed(expected):
    lost = []
    for good in expected:
        edited = good.e.astype(object)
        columns = [c for c in good.table.columns if identifies(c)][: len(edited)]
        for row, column in enumerate(columns):
            cell = edited.loc[row, column.name]
            words = {"text": f"{cell}!", "flag": pd.isna(cell) or not cell}
            edited.loc[row, column.name] = words.get(column.kind, 97)
        text = "\n".join(messages(good, edited))
        rows = [row for row in range(len(columns)) if f"row {row + 1} (" not in text]
        lost += [(good.table.name, columns[row].name) for row in rows]
    assert lost == []


EDITS = {
    "deleted": lambda f: f.iloc[:-1],
    "doubled": lambda f: pd.concat([f, f.iloc[[-1]]]),
    "swapped": lambda f: f.iloc[[-1, *range(1, len(f) - 1), 0]] if len(f) > 1 else f.iloc[:0],
}


@pytest.mark.parametrize("edit", EDITS)
def test_deleted_doubled_and_swapped_rows_are_noticed(edit, expected):
    edited = [(good, EDITS[edit](good.e)) for good in expected]
    assert [good.table.name for good, frame in edited if not messages(good, frame)] == []


def test_a_table_without_a_column_is_refused(expected):
    for good in expected:
        for name in good.table.column_names[:: len(good.table.columns) - 1]:
            with pytest.raises(StorageError, match=f"lacks the column.*{name}"):
                good.table.checked(good.e.drop(columns=name))
