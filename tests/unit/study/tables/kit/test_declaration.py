"""Declarations of tables: errors, conversion of a frame, and those of the study."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import StorageError
from pdrom.core.store import read_table, write_table
from study.artifact.reads import Setting
from study.tables import declared
from study.tables.kit.declaration import flag, integer, number, table, text, timed

COLUMNS = (
    text("name", "a word"),
    integer("count", "a count"),
    number("size", "a size", "m"),
    flag("good", "yes or no"),
    timed(number("seconds", "a time", "s")),
)


@table(title="An invented table", columns=COLUMNS, reads={"rows": Setting("rows")})
def invented(rows: list[dict]) -> pd.DataFrame:
    """Rows as they are."""
    return pd.DataFrame(rows)


ROW = {"name": "a", "count": 3, "size": 0.5, "good": True, "seconds": 1.5}
CELLS = {
    "name": st.sampled_from(["a", "b c", None]),
    "count": st.integers(-9, 9) | st.none(),
    "size": st.floats(allow_nan=False) | st.none(),
    "good": st.booleans() | st.none(),
    "seconds": st.floats(0.0, 1.0) | st.none(),
}


@given(st.lists(st.fixed_dictionaries(CELLS), min_size=1, max_size=6))
def test_columns_have_the_declared_types_even_if_they_are_empty(rows):
    made = invented(rows)
    assert tuple(made.columns) == invented.column_names
    types = {"count": "Int64", "size": "float64", "good": "boolean"}
    assert {c: str(made[c].dtype) for c in types} == types
    for name in CELLS:
        assert [None if pd.isna(v) else v for v in made[name]] == [row[name] for row in rows]


@pytest.mark.parametrize("content", [pd.DataFrame(), pd.DataFrame(columns=["name"])])
def test_the_file_of_a_table_without_rows_has_its_columns(content, tmp_path):
    write_table(invented.checked(content), tmp_path / "t.csv")
    assert tuple(read_table(tmp_path / "t.csv").columns) == invented.column_names


@pytest.mark.parametrize("order", [(0, 1), (1, 0), (0, 1, 2)])
def test_a_column_of_flags_keeps_its_type_if_a_part_has_none(order):
    """A file without runs has a column of empty numbers."""
    cells = pd.Series([True]), pd.Series([np.nan]), pd.Series([1.0])
    rows = pd.DataFrame([ROW] * len(order)).drop(columns="good")
    good = invented.checked(rows.assign(good=pd.concat([cells[i] for i in order]).array)).good
    assert good.notna().tolist() == [i != 1 for i in order]
    assert good.dropna().all()


def test_columns_are_in_declared_order_and_numbers_are_written_alike(tmp_path):
    """A column of objects would be written with all digits."""
    row = {name: ROW[name] for name in reversed(ROW)} | {"size": 1.0 / 3.0, "more": 1}
    made = invented.checked(pd.DataFrame([row], index=[5]).astype({"size": object}))
    assert tuple(made.columns) == invented.column_names
    assert list(made.index) == [0]
    write_table(made, tmp_path / "t.csv")
    assert "0.3333333333," in (tmp_path / "t.csv").read_text()


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (ROW | {"count": 1.5}, "invented: .*'count'"),
        (ROW | {"count": "many"}, "'count'"),
        (ROW | {"size": "large"}, "'size'"),
        (ROW | {"good": "perhaps"}, "'good'"),
        ({"name": "a", "size": 1.0, "seconds": 2.0}, "invented: .* count, good"),
    ],
)
def test_a_value_of_a_wrong_type_is_named_with_its_column(row, message):
    with pytest.raises(StorageError, match=message):
        invented([row])


@pytest.mark.parametrize(
    ("columns", "reads", "message"),
    [
        (COLUMNS, {"rows": Setting("a"), "other": Setting("b")}, "lonely_table: .*other"),
        ((*COLUMNS, integer("count", "again")), {"rows": Setting("a")}, "table lonely: .*count"),
    ],
    ids=["a function must take what it reads", "a column is declared once"],
)
def test_a_faulty_declaration_is_refused(columns, reads, message):
    with pytest.raises(TypeError, match=message):

        @table(title="", columns=columns, reads=reads)
        def lonely(rows):
            """Nothing."""


def test_every_column_has_a_description_and_measured_times_are_marked_as_timed():
    for name, made in declared().items():
        assert made.title
        for column in made.columns:
            assert column.meaning, (name, column.name)
            if column.unit in ("s", "ms") and column.name != "h":  # which is set
                assert column.timed, (name, column.name)
