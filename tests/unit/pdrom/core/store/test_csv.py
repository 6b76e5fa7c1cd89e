"""Tables: what is written is read, faults are named."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import SceneError, StorageError
from pdrom.core.store import read_table, require_finite, write_table

TABLE = pd.DataFrame(
    {
        "scene": ["a", "b", "c"],
        "r": pd.array([1, None, 3], dtype="Int64"),
        "error": [0.1, np.nan, 1e-300],
        "finite": [True, False, True],
    }
)


def test_table_round_trip(tmp_path):
    path = tmp_path / "t.csv"
    write_table(TABLE, path)
    back = read_table(path, ["scene", "error"])
    assert list(back.columns) == list(TABLE.columns)
    np.testing.assert_allclose(back.error, TABLE.error, rtol=1e-9)
    assert back.r.isna().tolist() == [False, True, False]
    assert back.finite.tolist() == [True, False, True]
    write_table(back.astype({"r": "Int64"}), tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == path.read_bytes()


def test_empty_cells_and_digits_of_a_table(tmp_path):
    write_table(TABLE, tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_bytes() == (
        b"scene,r,error,finite\na,1,0.1,True\nb,,,False\nc,3,1e-300,True\n"
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"", "not a readable table"),
        (b"a,b\n1,2\n1,2,3\n", "not a readable table"),
        (b"a,b\n\xff\xfe,2\n", "not a readable table"),
        (b"a,b\n1,2\n", r"lacks the column\(s\) c, d"),
    ],
)
def test_faulty_tables_are_named(tmp_path, content, message):
    path = tmp_path / "t.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StorageError, match=rf"t\.csv.*{message}"):
        read_table(path, ["a", "c", "d"], result=False)


def test_a_table_that_no_run_makes_needs_no_checksum_and_stays(tmp_path):
    path = tmp_path / "reference.csv"
    path.write_text("a,b\n1,2\n")
    assert len(read_table(path, result=False)) == 1
    path.write_text("a,b\n1,2\n3,")
    with pytest.raises(StorageError, match="end of its last line is missing"):
        read_table(path, result=False)
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_of_the_results_needs_its_checksum(tmp_path):
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    with pytest.raises(StorageError, match=r"t\.csv: its checksum .* is missing"):
        read_table(tmp_path / "t.csv")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_number_that_is_none_is_named(bad):
    array = np.zeros((3, 4))
    assert require_finite("x", array, SceneError) is array
    array[1, 2] = array[2, 0] = bad
    with pytest.raises(SceneError, match=rf"x: entry \(1, 2\) is {bad}"):
        require_finite("x", array, SceneError)
