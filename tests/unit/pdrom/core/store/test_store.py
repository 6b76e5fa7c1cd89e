"""Files are written completely or not at all, with checksums; tables and HDF5 files."""

import errno
import os
import signal
import subprocess
import sys

import h5py
import numpy as np
import pandas as pd
import pytest

from builders import write_result
from pdrom.core import store
from pdrom.core.errors import StorageError
from pdrom.core.provenance import made_by
from pdrom.core.store import open_hdf5
from pdrom.core.store.checksum import damaged_set_aside, new_checksum


def test_a_complete_file_takes_the_name_while_readers_keep_the_old_file(tmp_path):
    path = tmp_path / "new" / "folder" / "result.txt"
    with store.atomic_path(path) as temporary:
        temporary.write_text("old")
        assert not path.exists()
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
    with open(path) as reader:
        with store.atomic_path(path) as temporary:
            temporary.write_text("new and longer")
        assert reader.read() == "old"
    assert path.read_text() == "new and longer"
    assert sorted(path.parent.iterdir()) == sorted([path, store.checksum_path(path)])


LACKS = [OSError(n, os.strerror(n)) for n in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO)]


@pytest.mark.parametrize("suffix", [".h5", ".csv"])
@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize("fault", [*LACKS, KeyboardInterrupt(), MemoryError()])
def test_a_failed_write_is_named_or_an_interrupt_raised_and_the_old_file_stays(
    tmp_path, monkeypatch, suffix, call, fault
):
    path = tmp_path / f"result{suffix}"
    write_result(path)
    before, names = path.read_bytes(), sorted(tmp_path.iterdir())

    def fail(*_):
        raise fault

    monkeypatch.setattr(os, call, fail)
    with pytest.raises(StorageError if fault in LACKS else type(fault)) as caught:
        write_result(path, 2.0)
    if fault in LACKS:
        assert str(caught.value) == f"{path}: cannot be written ({fault.strerror})"
    assert path.read_bytes() == before
    assert store.check_file(path) == "intact"
    assert sorted(tmp_path.iterdir()) == names


KILLED_AT_A_NAME = """
import os, signal, sys
from pdrom.core.store import write_text
path, count, replace, calls = sys.argv[1], int(sys.argv[2]), os.replace, []
def killed(*arguments):
    calls.append(arguments)
    if len(calls) > count:
        os.kill(os.getpid(), signal.SIGKILL)
    replace(*arguments)
os.replace = killed
write_text("new", path)
"""


@pytest.mark.parametrize("existed", [False, True])
@pytest.mark.parametrize("count", [0, 1])
def test_a_kill_between_checksum_and_file_is_repaired_by_the_next_write(tmp_path, existed, count):
    """The old file is intact or noticed as damaged; no file remains without a checksum.

    The next write removes the files of the killed process, and no others.
    """
    path, other = tmp_path / "result.txt", tmp_path / ".results.0123456789ab.txt"
    other.write_text("of another file")
    if existed:
        store.write_text("old", path)
    command = [sys.executable, "-c", KILLED_AT_A_NAME, path, str(count)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert list(tmp_path.glob(".result.*.txt"))
    assert path.exists() == existed
    if existed:
        assert store.check_file(path) == ("damaged" if count else "intact")
    store.write_text("new", path)
    assert store.read_text(path) == "new"
    assert sorted(tmp_path.iterdir()) == sorted([path, store.checksum_path(path), other])


@pytest.mark.parametrize("kind", ["a link", "no regular file", "a folder"])
@pytest.mark.parametrize("place", [store.require_own, lambda path: store.write_text("new", path)])
def test_a_path_that_is_no_regular_file_is_refused_and_stays(tmp_path, kind, place):
    path = tmp_path / "result.txt"
    if kind == "a link":
        (tmp_path / "other").write_text("mine")
        path.symlink_to(tmp_path / "other")
    elif kind == "no regular file":
        os.mkfifo(path)
    else:
        path.mkdir()
    before, names = path.lstat(), sorted(tmp_path.iterdir())
    with pytest.raises(StorageError, match=rf"result\.txt: cannot be written \({kind}"):
        place(path)
    assert path.lstat().st_mode == before.st_mode
    assert sorted(tmp_path.iterdir()) == names
    assert kind != "a link" or (tmp_path / "other").read_text() == "mine"


def test_a_file_of_another_program_is_refused(tmp_path):
    path = tmp_path / "result.txt"
    store.require_own(path)
    path.write_text("mine")
    with pytest.raises(StorageError, match="a file that pdrom has not made"):
        store.require_own(path)
    store.write_text("ours", path)
    store.require_own(path)
    path.write_bytes(b"<meta content='" + store.MARK + b"'>")
    store.require_own(path)
    path.write_text("# sheet made by pdrom's author")
    with pytest.raises(StorageError, match="a file that pdrom has not made"):
        store.require_own(path)


def test_two_writers_of_one_file_do_not_see_each_other(tmp_path):
    path = tmp_path / "result.txt"
    with store.atomic_path(path) as first:
        first.write_text("first")
        store.write_text("second", path)
        assert first.read_text() == "first"
    assert path.read_text() == "first"
    assert sorted(path.parent.iterdir()) == sorted([path, store.checksum_path(path)])


@pytest.mark.parametrize("kind", ["external", "soft", "storage", "virtual"])
def test_an_hdf5_file_that_refers_to_other_files_is_refused(tmp_path, kind):
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = np.zeros(4)
    with h5py.File(path, "w") as file:
        inside = file.create_group("inside")
        inside["back"] = file  # groups that contain each other
        store.require_self_contained(file, path)
        if kind == "external":
            inside["x"] = h5py.ExternalLink(str(other), "/x")
        elif kind == "soft":
            inside["x"] = h5py.SoftLink("/nowhere")
        elif kind == "storage":
            inside.create_dataset("x", (4,), "f8", external=[(str(tmp_path / "raw"), 0, 32)])
        else:
            layout = h5py.VirtualLayout((4,), "f8")
            layout[:] = h5py.VirtualSource(str(other), "x", (4,))
            inside.create_virtual_dataset("x", layout)
        with pytest.raises(StorageError, match="x refers to data outside this file"):
            store.require_self_contained(file, path)


TABLE = pd.DataFrame(
    {
        "scene": ["a", "b", "c"],
        "r": pd.array([1, None, 3], dtype="Int64"),
        "error": [0.1, np.nan, 1e-300],
        "finite": [True, False, True],
    }
)


def test_a_table_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "t.csv"
    store.write_table(TABLE, path)
    lines = b"scene,r,error,finite\na,1,0.1,True\nb,,,False\nc,3,1e-300,True\n"
    assert path.read_bytes() == lines
    back = store.read_table(path, ["scene", "error"])
    assert list(back.columns) == list(TABLE.columns)
    np.testing.assert_allclose(back.error, TABLE.error, rtol=1e-9)
    assert back.r.isna().tolist() == [False, True, False]
    assert back.finite.tolist() == [True, False, True]
    store.write_table(back.astype({"r": "Int64"}), tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read"),
        (b"", "not a readable table"),
        (b"a,b\n1,2\n1,2,3\n", "not a readable table"),
        (b"a,b\n\xff\xfe,2\n", "not a readable table"),
        (b"a,b\n1,2\n", r"lacks the column\(s\) c, d"),
        (b"a,b\n1,2\n3,", "the end of its last line is missing"),
    ],
)
def test_faulty_tables_are_named(tmp_path, content, message):
    path = tmp_path / "t.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StorageError, match=rf"t\.csv.*{message}"):
        store.read_table(path, ["a", "c", "d"], result=False)
    assert path.exists() == (content is not None)


def test_missing_files_datasets_and_attributes_are_named(tmp_path):
    path = tmp_path / "few.h5"
    with pytest.raises(StorageError, match=r"few\.h5: no such file"), open_hdf5(path):
        pass
    with store.write_hdf5(path) as file:
        file["x"] = 1
    with pytest.raises(StorageError, match=r"few\.h5.*'?y'?"), open_hdf5(path) as file:
        file["y"][...]
    with pytest.raises(StorageError, match=r"few\.h5.*unit"), open_hdf5(path) as file:
        assert (type(file), file.mode) == (h5py.File, "r")
        file.attrs["unit"]


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


def test_a_full_disk_in_the_middle_of_a_file_leaves_no_file(tmp_path):
    """The child process limits the size of its files, which acts like a full disk."""
    path = tmp_path / "result.h5"
    # the data file of a coverage measurement would also exceed the limit
    variables = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE")}
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, path], capture_output=True, text=True, check=False,
        env=variables,
    )  # fmt: skip
    assert done.stderr == f"{path}: cannot be written ({os.strerror(errno.EFBIG)})\n"
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def plain(tmp_path):
    """An HDF5 file of an older pdrom, with its checksum in a hidden file next to it."""
    path = tmp_path / "old.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(1000)
    store.checksum_path(path).write_bytes(new_checksum("0" * 128, path.name).content)
    return path


def test_a_file_without_a_checksum_inside_is_refused_unless_it_is_allowed(plain):
    assert store.check_file(plain) == "no checksum"
    expected = r"old\.h5: no checksum inside .*; --unchecked \(.*\) reads it if its data are valid$"
    with pytest.raises(StorageError, match=expected), open_hdf5(plain):
        pass
    with open_hdf5(plain, unchecked=True) as file:
        assert file["x"][...].sum() == 499500
    os.truncate(plain, 3000)
    with pytest.raises(StorageError, match=r"old\.h5: cannot be read"), open_hdf5(plain, True):
        pass
    assert sorted(plain.parent.iterdir()) == sorted([plain, store.checksum_path(plain)])


@pytest.mark.parametrize("damaged", [True, False])
def test_an_error_while_reading_leads_to_another_check(tmp_path, damaged):
    """A file damaged after the first check is renamed; other read errors rename nothing."""
    path = tmp_path / "a.h5"
    with made_by("job", {}, "c0de"), store.write_hdf5(path) as file:
        file["x"] = 1
    message = "renamed to" if damaged else os.strerror(errno.ENOLCK)
    with damaged_set_aside(), pytest.raises(StorageError, match=message), open_hdf5(path):
        if damaged:
            os.truncate(path, 3000)
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))
    assert path.exists() != damaged
