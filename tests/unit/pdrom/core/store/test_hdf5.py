"""HDF5: equal bytes for equal content, faults that are named."""

import errno
import os
import subprocess
import sys

import h5py
import numpy as np
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import check_file, checksum_path, open_hdf5, write_hdf5
from pdrom.core.store.checksum import damaged_set_aside, new_checksum


def test_equal_content_equal_bytes(tmp_path):
    for name in ("one.h5", "two.h5"):
        with write_hdf5(tmp_path / name) as file:
            file.attrs["title"] = "t"
            file["b"] = np.linspace(0.0, 1.0, 50)
            file["a/c"] = np.arange(4)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


def test_missing_pieces_are_named(tmp_path):
    path = tmp_path / "few.h5"
    with pytest.raises(StorageError, match=r"few\.h5: no such file"), open_hdf5(path):
        pass
    with write_hdf5(path) as file:
        file["x"] = 1
    with pytest.raises(StorageError, match=r"few\.h5.*'?y'?"), open_hdf5(path) as file:
        file["y"][...]
    with pytest.raises(StorageError, match=r"few\.h5.*unit"), open_hdf5(path) as file:
        assert (type(file), file.mode) == (h5py.File, "r")
        file.attrs["unit"]


@pytest.mark.parametrize("fault", [ZeroDivisionError, KeyboardInterrupt])
def test_a_failure_inside_hdf5_leaves_the_old_file(tmp_path, fault):
    path = tmp_path / "result.h5"
    path.write_text("old")
    with pytest.raises(fault), write_hdf5(path) as file:
        file["x"] = np.arange(1000.0)
        raise fault
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


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
    # what it measured of coverage would not fit, either
    variables = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE")}
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, path], capture_output=True, text=True, check=False,
        env=variables,
    )  # fmt: skip
    assert done.stderr == f"{path}: cannot be written ({os.strerror(errno.EFBIG)})\n"
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_not_hdf5_is_named_and_left_alone(tmp_path):
    for name in ("a.h5", "a.yaml"):
        (tmp_path / name).write_text("no HDF5")
        for unchecked in (False, True):
            expected = rf"{name}: .*(checksum|cannot be read)"
            with pytest.raises(StorageError, match=expected), open_hdf5(tmp_path / name, unchecked):
                pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "a.yaml"]


@pytest.fixture
def plain(tmp_path):
    """A file of HDF5 without a checksum inside, as an older pdrom wrote it: with a hidden one."""
    path = tmp_path / "old.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(1000)
    checksum_path(path).write_bytes(new_checksum("0" * 128, path.name).content)
    return path


def test_a_file_without_a_checksum_inside_is_refused_unless_asked_for(plain):
    assert check_file(plain) == "no checksum"
    expected = r"old\.h5: no checksum inside .*; --unchecked \(.*\) reads it if it is sound$"
    with pytest.raises(StorageError, match=expected), open_hdf5(plain):
        pass
    with open_hdf5(plain, unchecked=True) as file:
        assert file["x"][...].sum() == 499500
    os.truncate(plain, 3000)
    with pytest.raises(StorageError, match=r"old\.h5: cannot be read"), open_hdf5(plain, True):
        pass
    assert sorted(plain.parent.iterdir()) == sorted([plain, checksum_path(plain)])


def test_a_wrong_checksum_is_refused_also_by_who_asks_for_none(tmp_path):
    path = tmp_path / "a.h5"
    with write_hdf5(path) as file:
        file["x"] = np.arange(1000)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(StorageError, match="checksum differ"), open_hdf5(path, unchecked=True):
        pass


def test_a_new_file_takes_the_hidden_checksum_of_an_old_one_along(plain):
    with write_hdf5(plain) as file:
        file["x"] = 1
    assert list(plain.parent.iterdir()) == [plain]
    assert check_file(plain) == "intact"


@pytest.mark.parametrize("damaged", [True, False])
def test_an_error_while_reading_leads_to_another_check(tmp_path, damaged):
    """What the disk lost after the first check is set aside; another error is not damage."""
    path = tmp_path / "a.h5"
    with write_hdf5(path) as file:
        file["x"] = 1
    message = "set aside" if damaged else os.strerror(errno.ENOLCK)
    with damaged_set_aside(), pytest.raises(StorageError, match=message), open_hdf5(path):
        if damaged:
            os.truncate(path, 3000)
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))
    assert path.exists() != damaged
