"""Files: whole or not at all, equal bytes for equal content, faults that are named."""

import h5py
import numpy as np
import pandas as pd
import pytest

from pdrom.errors import SceneError, StorageError
from pdrom.store import (
    atomic_path,
    open_hdf5,
    read_table,
    require_finite,
    write_hdf5,
    write_table,
)


def fail_after(function, *args, **settings):
    """A job that dies when it has written something."""
    function(*args, **settings)
    raise ZeroDivisionError


def test_failure_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), atomic_path(path) as temporary:
        fail_after(temporary.write_text, "half")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_name_appears_only_when_complete(tmp_path):
    path = tmp_path / "new" / "folder" / "result.txt"
    with atomic_path(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
    assert path.read_text() == "whole"
    assert list(path.parent.iterdir()) == [path]


def test_who_reads_the_old_file_keeps_it(tmp_path):
    """The new file takes the name, it is not written into the old one."""
    path = tmp_path / "result.txt"
    path.write_text("old")
    with open(path) as reader:
        with atomic_path(path) as temporary:
            temporary.write_text("new and longer")
        assert reader.read() == "old"
    assert path.read_text() == "new and longer"


def test_failed_hdf5_leaves_the_old_file(tmp_path):
    path = tmp_path / "result.h5"
    with write_hdf5(path) as file:
        file["x"] = np.arange(3)
    before = path.read_bytes()
    with pytest.raises(ZeroDivisionError), write_hdf5(path) as file:
        fail_after(file.create_dataset, "x", data=np.arange(9))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_cannot_be_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "taken").mkdir()
    with pytest.raises(StorageError, match=r"taken: cannot be written"):
        write_table(pd.DataFrame({"a": [1]}), tmp_path / "taken")
    assert (tmp_path / "taken").is_dir()


def test_equal_content_equal_bytes(tmp_path):
    for name in ("one.h5", "two.h5"):
        with write_hdf5(tmp_path / name) as file:
            file.attrs["title"] = "t"
            file["b"] = np.linspace(0.0, 1.0, 50)
            file["a/c"] = np.arange(4)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


@pytest.mark.parametrize("kept", [0.0, 0.1, 0.5, 0.9])
def test_truncated_hdf5_is_named(tmp_path, kept):
    path = tmp_path / "cut.h5"
    with write_hdf5(path) as file:
        file["x"] = np.random.default_rng(0).standard_normal((200, 50))
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(StorageError, match=r"cut\.h5"), open_hdf5(path) as file:
        file["x"][...]


def test_missing_pieces_are_named(tmp_path):
    path = tmp_path / "few.h5"
    with pytest.raises(StorageError, match=r"few\.h5: no such file"), open_hdf5(path):
        pass
    with write_hdf5(path) as file:
        file["x"] = 1
    with pytest.raises(StorageError, match=r"few\.h5.*'?y'?"), open_hdf5(path) as file:
        file["y"][...]
    with pytest.raises(StorageError, match=r"few\.h5.*unit"), open_hdf5(path) as file:
        file.attrs["unit"]


def test_reading_does_not_write(tmp_path):
    path = tmp_path / "a.h5"
    with write_hdf5(path) as file:
        file["x"] = 1
    with open_hdf5(path) as file:
        assert isinstance(file, h5py.File)
        assert file.mode == "r"


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
        read_table(path, ["a", "c", "d"])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_number_that_is_none_is_named(bad):
    array = np.zeros((3, 4))
    assert require_finite("x", array, SceneError) is array
    array[1, 2] = array[2, 0] = bad
    with pytest.raises(SceneError, match=rf"x: entry \(1, 2\) is {bad}"):
        require_finite("x", array, SceneError)
