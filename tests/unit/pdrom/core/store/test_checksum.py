"""Any damage of a result or its checksum is noticed, and the file is made again."""

import errno
import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import h5py
import pytest

from builders import write_result
from pdrom import __version__
from pdrom.core import store
from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.core.store.checksum import BLOCK, damaged_set_aside, provenance_of


def read_one(path: Path, unchecked: bool = False) -> None:
    if path.suffix == ".h5":
        with open_hdf5(path, unchecked) as file:
            file.visititems(lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None)
    elif path.suffix == ".csv":
        store.read_table(path)
    else:
        store.read_text(path)


@pytest.fixture(scope="module", params=["r.h5", "r.csv", "r.tex"])
def result(request, tmp_path_factory) -> Path:
    """A small result with its checksum; `noticed` undoes the changes of a test."""
    path = tmp_path_factory.mktemp("result") / request.param
    write_result(path)
    assert store.check_file(path) == "intact"
    # only HDF5 files contain their checksum
    beside = [] if path.suffix == ".h5" else [store.checksum_path(path)]
    assert [p for p in path.parent.iterdir() if p != path] == beside
    return path


def checksum_of(path: Path) -> bytes:
    inside = path.suffix == ".h5"
    return path.read_bytes()[:BLOCK] if inside else store.checksum_path(path).read_bytes()


def places(checksum: bytes) -> list[int]:
    """Indices of every byte of a checksum, and of some zeros that fill the block after it."""
    told = len(checksum.rstrip(b"\0"))
    return [*range(told), *range(told, len(checksum), 100)]


def noticed(path: Path, content: bytes | None = None, checksum: bytes | None = None) -> bool:
    """Replace the file's bytes or its checksum; return True if every reader reports the damage.

    A job renames the damaged file; every other reader leaves it in place, and a reader that accepts
    files without a checksum refuses it, too. The old files are restored.
    """
    before = {p: p.read_bytes() for p in path.parent.iterdir()}
    if content is not None:
        path.write_bytes(content)
    if checksum is not None and path.suffix == ".h5":
        path.write_bytes(checksum + path.read_bytes()[BLOCK:])
    elif checksum is not None:
        store.checksum_path(path).write_bytes(checksum)
    changed = {p: p.read_bytes() for p in path.parent.iterdir()}
    assert store.check_file(path) == "damaged"
    with pytest.raises(StorageError, match=rf"{path.name}: damaged"):
        read_one(path, unchecked=True)
    assert {p: p.read_bytes() for p in path.parent.iterdir()} == changed
    aside = path.with_name(f"{path.name}.damaged")
    with damaged_set_aside(), pytest.raises(StorageError, match=aside.name):
        read_one(path)
    assert [p.name for p in path.parent.iterdir()] == [aside.name]
    aside.unlink()
    for place, old in before.items():
        place.write_bytes(old)
    return True


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def damages(content: bytes) -> Iterator[bytes]:
    """The content with overwritten end, cut, with a line removed or repeated, with bytes added."""
    for count in (1, 512, 4096):
        kept = content[: max(0, len(content) - count)]
        yield from (kept.ljust(len(content), filler) for filler in (b"\0", b"\xff"))
    lines = content.splitlines(keepends=True)
    for i in range(len(lines)):
        yield b"".join(lines[:i])
        yield b"".join(lines[:i] + lines[i + 1 :])
        yield b"".join(lines[: i + 1] + lines[i:])
    yield from (content[:kept] for kept in (*range(0, len(content), 512), len(content) - 1))
    yield from (content + more for more in (b"\0", b"\n", b"a,b\n"))


def test_every_damage_of_a_result_is_noticed(result):
    content = result.read_bytes()
    for changed in {*damages(content)} - {content}:  # the last byte of an HDF5 file may be a zero
        assert noticed(result, changed)


def test_every_changed_bit_and_every_cut_of_the_checksum_is_noticed(result):
    checksum = checksum_of(result)
    flips = [flipped(checksum, 8 * i + i % 8) for i in places(checksum)]
    # an HDF5 file without its first block is a file without a checksum
    cuts = [checksum[:kept] for kept in places(checksum) if kept or result.suffix != ".h5"]
    for changed in (*flips, *cuts, checksum + b"\n", checksum.upper()):
        assert noticed(result, checksum=changed)


def test_a_checksum_records_the_provenance_and_is_valid_without_it(result):
    assert provenance_of(result)["pdrom_version"] == __version__
    if result.suffix == ".h5":
        behind = hashlib.blake2b(result.read_bytes()[BLOCK:]).hexdigest()
        assert f"{behind}  -\n".encode() in checksum_of(result)
        return
    checksum = store.checksum_path(result).read_bytes()
    store.checksum_path(result).write_bytes(checksum.split(b"\n", 1)[1])
    assert (store.check_file(result), provenance_of(result)) == ("intact", {})
    store.checksum_path(result).write_bytes(checksum)


def test_only_a_job_renames_a_copy_that_lost_its_checksum_others_refuse_it(result, tmp_path):
    copy = Path(shutil.copy(result, tmp_path))
    if copy.suffix == ".h5":  # the checksum is inside
        read_one(copy)
        assert store.check_file(copy) == "intact"
        return
    assert store.check_file(copy) == "no checksum"
    with pytest.raises(StorageError, match=r"its checksum \.r\."):
        read_one(copy)
    assert list(tmp_path.iterdir()) == [copy]
    with damaged_set_aside(), pytest.raises(StorageError, match=r"its checksum \.r\."):
        read_one(copy)
    assert [p.name for p in tmp_path.iterdir()] == [f"{result.name}.damaged"]


@pytest.mark.parametrize(
    ("number", "aside"), [(errno.EIO, True), (errno.EACCES, False), (errno.ENOMEM, False)]
)
def test_only_damaged_files_are_renamed_not_unreadable_ones(tmp_path, monkeypatch, number, aside):
    """A file without permission to read, or one that fails temporarily, is not damaged."""
    path = tmp_path / "t.csv"
    write_result(path)

    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("hashlib.file_digest", fail)
    expected = "renamed to" if aside else os.strerror(number)
    with damaged_set_aside(), pytest.raises(StorageError, match=expected):
        store.read_table(path)
    assert path.exists() != aside
