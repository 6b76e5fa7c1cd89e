"""Files: whole or not at all, and never without the checksum that fits them."""

import errno
import os
import signal
import subprocess
import sys

import h5py
import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import (
    MARK,
    atomic_path,
    check_file,
    checksum_path,
    read_text,
    require_own,
    require_place,
    require_self_contained,
    write_hdf5,
    write_table,
    write_text,
)


def test_name_appears_only_when_complete(tmp_path):
    path = tmp_path / "new" / "folder" / "result.txt"
    with atomic_path(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
    assert path.read_text() == "whole"
    assert sorted(path.parent.iterdir()) == sorted([path, checksum_path(path)])


def test_who_reads_the_old_file_keeps_it(tmp_path):
    """The new file takes the name, it is not written into the old one."""
    path = tmp_path / "result.txt"
    path.write_text("old")
    with open(path) as reader:
        with atomic_path(path) as temporary:
            temporary.write_text("new and longer")
        assert reader.read() == "old"
    assert path.read_text() == "new and longer"


def test_a_folder_that_cannot_be_is_named(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(StorageError, match=r"taken: cannot be written"):
        write_table(pd.DataFrame({"a": [1]}), tmp_path / "taken")
    assert list(tmp_path.iterdir()) == [tmp_path / "taken"]


def write_one(path, kind, value=1.0):
    """Write ``path`` in one of the ways that the package has."""
    if kind == "hdf5":
        with write_hdf5(path) as file:
            file["x"] = np.full(100, value)
    elif kind == "table":
        write_table(pd.DataFrame({"x": [value]}), path)
    else:
        write_text(f"{value}\n", path)


def old_file(tmp_path, kind):
    """An intact file, its bytes, and a check that it is as it was and nothing else was left."""
    path = tmp_path / "result"
    write_one(path, kind)
    before = path.read_bytes()
    names = sorted(tmp_path.iterdir())
    assert names == sorted([path] if kind == "hdf5" else [path, checksum_path(path)])

    def untouched():
        assert path.read_bytes() == before
        assert check_file(path) == "intact"
        assert sorted(tmp_path.iterdir()) == names
        return True

    return path, untouched


def let_through(monkeypatch, call, count, fault):
    """The system call ``call`` works ``count`` times, then raises ``fault``."""
    real, calls = getattr(os, call), []

    def limited(*arguments):
        calls.append(arguments)
        if len(calls) > count:
            raise fault
        return real(*arguments)

    monkeypatch.setattr(os, call, limited)


# a kind of file, and how many calls work: there is a second one for a checksum beside it
CALLS = [("hdf5", 0), ("table", 0), ("table", 1), ("text", 0), ("text", 1)]


@pytest.mark.parametrize(("kind", "count"), CALLS)
@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO])
def test_a_system_call_that_fails_leaves_the_old_file(
    tmp_path, monkeypatch, kind, call, count, number
):
    path, untouched = old_file(tmp_path, kind)
    let_through(monkeypatch, call, count, OSError(number, os.strerror(number)))
    with pytest.raises(StorageError) as caught:
        write_one(path, kind, 2.0)
    assert str(caught.value) == f"{path}: cannot be written ({os.strerror(number)})"
    assert untouched()


@pytest.mark.parametrize(("kind", "count"), CALLS)
@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, MemoryError])
def test_an_interruption_is_handed_on_and_leaves_the_old_file(
    tmp_path, monkeypatch, kind, count, interruption
):
    path, untouched = old_file(tmp_path, kind)
    let_through(monkeypatch, "replace", count, interruption())
    with pytest.raises(interruption):
        write_one(path, kind, 2.0)
    assert untouched()


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
def test_a_kill_between_the_checksum_and_the_file_is_healed(tmp_path, existed, count):
    """The old file is intact, or noticed as damaged; a file without a checksum is never left."""
    path = tmp_path / "result.txt"
    if existed:
        write_text("old", path)
    command = [sys.executable, "-c", KILLED_AT_A_NAME, path, str(count)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert path.exists() == existed
    if existed:
        assert check_file(path) == ("damaged" if count else "intact")
    write_text("new", path)
    assert read_text(path) == "new"
    assert sorted(tmp_path.iterdir()) == sorted([path, checksum_path(path)])


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


def occupied(folder, kind):
    """Something that is no regular file, in the place of a result."""
    path = folder / "result.txt"
    if kind == "a link":
        (folder / "other").write_text("mine")
        path.symlink_to(folder / "other")
    elif kind == "no regular file":
        os.mkfifo(path)
    else:
        path.mkdir()
    return path


@pytest.mark.parametrize("kind", ["a link", "no regular file", "a folder"])
@pytest.mark.parametrize("place", [require_place, lambda path: write_text("new", path)])
def test_what_is_no_regular_file_is_refused_and_stays(tmp_path, kind, place):
    path = occupied(tmp_path, kind)
    before = path.lstat()
    with pytest.raises(StorageError, match=rf"result\.txt: cannot be written \({kind}"):
        place(path)
    assert path.lstat().st_mode == before.st_mode
    assert kind != "a link" or (tmp_path / "other").read_text() == "mine"


def test_a_device_is_refused():
    with pytest.raises(StorageError, match="no regular file"):
        require_place(os.devnull)


def test_a_file_of_another_program_is_refused(tmp_path):
    path = tmp_path / "result.txt"
    require_own(path)
    path.write_text("mine")
    with pytest.raises(StorageError, match="a file that pdrom has not made"):
        require_own(path)
    write_text("ours", path)
    require_own(path)
    path.write_bytes(b"<meta content='" + MARK + b"'>")
    require_own(path)
    path.write_text("# sheet made by pdrom's author")
    with pytest.raises(StorageError, match="a file that pdrom has not made"):
        require_own(path)


def test_a_hidden_file_of_another_program_stays(tmp_path):
    path = tmp_path / "page.html"
    checksum_path(path).write_text("mine")
    write_text("page", path, with_checksum=False)
    assert checksum_path(path).read_text() == "mine"


def test_who_writes_the_same_file_at_once_keeps_the_own(tmp_path):
    path = tmp_path / "result.txt"
    with atomic_path(path) as first:
        first.write_text("first")
        write_text("second", path)
        assert first.read_text() == "first"
    assert path.read_text() == "first"
    assert sorted(path.parent.iterdir()) == sorted([path, checksum_path(path)])


@pytest.mark.parametrize("kind", ["external", "soft", "storage", "virtual"])
def test_a_file_that_reads_others_is_refused(tmp_path, kind):
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = np.zeros(4)
    with h5py.File(path, "w") as file:
        inside = file.create_group("inside")
        inside["back"] = file  # a circle of groups
        require_self_contained(file, path)
        if kind == "external":
            inside["x"] = h5py.ExternalLink(str(other), "/x")
        elif kind == "soft":
            inside["x"] = h5py.SoftLink("/nowhere")
        elif kind == "storage":
            external = [(str(tmp_path / "raw"), 0, 32)]
            inside.create_dataset("x", (4,), "f8", external=external)
        else:
            layout = h5py.VirtualLayout((4,), "f8")
            layout[:] = h5py.VirtualSource(str(other), "x", (4,))
            inside.create_virtual_dataset("x", layout)
        with pytest.raises(StorageError, match="x is no data of this file"):
            require_self_contained(file, path)
