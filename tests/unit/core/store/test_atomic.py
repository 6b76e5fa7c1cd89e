"""Files: whole or not at all, and never without the checksum that fits them."""

import errno
import os
import signal
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import (
    atomic_path,
    check_file,
    checksum_path,
    read_text,
    write_hdf5,
    write_table,
    write_text,
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
