"""Files: whole or not at all, equal bytes for equal content, faults that are named."""

import errno
import os
import subprocess
import sys

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pdrom.core.errors import SceneError, StorageError
from pdrom.core.store import (
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


# Faults ---------------------------------------------------------------------------------------


SEAL_BYTES = len("pdrom-crc32:01234567\n")


def write_one(path, kind):
    """Write ``path`` in one of the ways that the package has."""
    if kind == "hdf5":
        with write_hdf5(path) as file:
            file["x"] = np.arange(100.0)
    elif kind == "table":
        write_table(TABLE, path)
    else:
        with atomic_path(path) as temporary:
            temporary.write_text("new")


@pytest.mark.parametrize("kind", ["hdf5", "table", "text"])
@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO])
def test_a_system_call_that_fails_leaves_the_old_file(tmp_path, monkeypatch, kind, call, number):
    path = tmp_path / "result"
    path.write_text("old")

    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, call, fail)
    with pytest.raises(StorageError) as caught:
        write_one(path, kind)
    assert str(caught.value) == f"{path}: cannot be written ({os.strerror(number)})"
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("kind", ["hdf5", "table", "text"])
@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, MemoryError])
def test_an_interruption_is_handed_on_and_leaves_the_old_file(
    tmp_path, monkeypatch, kind, interruption
):
    path = tmp_path / "result"
    path.write_text("old")

    def interrupt(*_):
        raise interruption

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(interruption):
        write_one(path, kind)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interruption_inside_hdf5_leaves_the_old_file(tmp_path):
    path = tmp_path / "result.h5"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), write_hdf5(path) as file:
        file["x"] = np.arange(1000.0)
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


KILLED = """
import os, signal, sys
import numpy as np
from pdrom.core.store import write_hdf5
with write_hdf5(sys.argv[1]) as file:
    file["x"] = np.arange(1000.0)
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_goes_with_the_next_write(tmp_path):
    path = tmp_path / "result.h5"
    other = tmp_path / ".results.0123456789ab.h5"
    other.write_text("of another file")
    subprocess.run([sys.executable, "-c", KILLED, path], check=False)
    (left,) = [p for p in tmp_path.iterdir() if p != other]
    assert left.name.startswith(".result.")
    write_one(path, "hdf5")
    assert sorted(tmp_path.iterdir()) == sorted([path, other])


LIMITED = """
import resource, sys
import numpy as np
from pdrom.core.errors import StorageError
from pdrom.core.store import write_hdf5
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    with write_hdf5(sys.argv[1]) as file:
        data = file.create_dataset("x", (100, 1000), dtype="f8")
        for i in range(100):
            data[i] = i
except StorageError as error:
    sys.exit(str(error))
"""


def test_no_space_in_the_middle_of_a_file(tmp_path):
    """By a limit on the size of files, in a process of its own."""
    path = tmp_path / "result.h5"
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, path], capture_output=True, text=True, check=False
    )
    assert done.stderr == f"{path}: cannot be written ({os.strerror(errno.EFBIG)})\n"
    assert list(tmp_path.iterdir()) == []


@given(position=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_every_changed_bit_of_hdf5_is_noticed(tmp_path, position, bit):
    path = tmp_path / "a.h5"
    with write_hdf5(path) as file:
        file["x"] = np.linspace(0.0, 1.0, 64)
        file["x"].attrs["unit"] = "m"
    content = bytearray(path.read_bytes())
    content[int(position * (len(content) - SEAL_BYTES))] ^= 1 << bit
    path.write_bytes(content)
    with pytest.raises(StorageError, match=r"a\.h5: damaged, .*set aside"), open_hdf5(path):
        pass


@given(kept=st.floats(0.0, 1.0, exclude_max=True))
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_every_truncation_of_hdf5_is_noticed(tmp_path, kept):
    path = tmp_path / "a.h5"
    write_one(path, "hdf5")
    os.truncate(path, int(kept * (path.stat().st_size - SEAL_BYTES)))
    with pytest.raises(StorageError, match=r"a\.h5: damaged"), open_hdf5(path):
        pass


def test_a_damaged_result_is_set_aside_so_that_it_is_made_anew(tmp_path):
    path = tmp_path / "a.h5"
    path.write_text("no HDF5")
    with pytest.raises(StorageError, match=r"set aside as a\.h5\.damaged"), open_hdf5(path):
        pass
    assert list(tmp_path.iterdir()) == [tmp_path / "a.h5.damaged"]


def test_a_damaged_table_that_no_run_makes_stays(tmp_path):
    path = tmp_path / "reference.csv"
    path.write_text("a,b\n1,2\n3,")
    with pytest.raises(StorageError, match="its end is missing"):
        read_table(path, result=False)
    assert path.exists()


def test_a_table_notices_a_missing_end_but_not_a_changed_digit(tmp_path):
    """CSV carries no checksum: this is its limit, stated in the README."""
    path = tmp_path / "t.csv"
    write_table(TABLE, path)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"0.1", b"0.2"))
    assert read_table(path).error[0] == 0.2
    path.write_bytes(content[:-3])
    with pytest.raises(StorageError, match="its end is missing"):
        read_table(path)


def test_the_seal_leaves_the_file_readable_by_others(tmp_path):
    path = tmp_path / "a.h5"
    write_one(path, "hdf5")
    with h5py.File(path, "r") as file:
        assert file["x"][-1] == 99.0
