"""Reading and writing results: atomic, deterministic, with checksums and clear errors.

A result is written to a temporary file next to its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one. Every reader checks
the result's checksum (`pdrom.core.store.checksum`).
"""

import hashlib
import io
import os
import platform
import re
import stat
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from pdrom.core.errors import StorageError, reason
from pdrom.core.provenance import attributes
from pdrom.core.store import checksum as sums
from pdrom.core.store.checksum import Condition, check_file, checksum_path, require_intact

if TYPE_CHECKING:  # pandas is not loaded by a run that writes no table
    import pandas as pd

__all__ = [
    "MARK", "Condition", "atomic_path", "check_file", "checksum_path", "open_hdf5", "read_table",
    "read_text", "require_finite", "require_intact", "require_own",
    "require_self_contained", "write_hdf5", "write_table", "write_text",
]  # fmt: skip
# Every page, picture and ParaView file of pdrom has this text in its first or last MARKED bytes.
MARK, MARKED = b"made by pdrom, which may replace this file", 65_536
# Hash of the machine's name, part of temporary file names, so that it removes only its files.
_MACHINE = hashlib.blake2b(platform.node().encode(), digest_size=2).hexdigest()


@contextmanager
def atomic_path(path: str | os.PathLike[str], with_checksum: bool = True) -> Iterator[Path]:
    """Yield a temporary path; on success it is renamed to ``path`` with a checksum, else removed.

    Temporary files of ``path`` that killed processes of this machine have left are removed. A file
    that has its checksum inside, or is written to a user's folder, has none next to it. Raises
    StorageError if the folder or file cannot be written (no permission, no space), or ``path`` is
    not a regular file but a folder, link, device or pipe, which a new file would replace.
    """
    target = Path(path)
    _require_file(target)
    mark = f"{_MACHINE}{os.getpid():08x}{uuid.uuid4().hex[:4]}"
    temporary = target.with_name(f".{target.stem}.{mark}{target.suffix}")
    checksum = temporary.with_name(f"{temporary.name}{sums.CHECKSUM_SUFFIX}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(target)
        yield temporary
        _bring_to_disk(temporary)
        if with_checksum:
            made = sums.new_checksum(sums.digest_of(temporary), target.name, target)
            checksum.write_bytes(made.content)
            _bring_to_disk(checksum)
            # the checksum first: a process killed in between then leaves a result that is missing
            # or does not match its checksum, and the next run makes it again
            os.replace(checksum, checksum_path(target))
        os.replace(temporary, target)
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({reason(error)})") from error
    finally:
        for left in (temporary, checksum):
            with suppress(OSError):
                left.unlink(missing_ok=True)


def require_own(path: str | os.PathLike[str]) -> None:
    """Check, before a long computation of a result, that ``path`` can be written.

    Raises StorageError if it is not a regular file, if its folder cannot be made or written to, or
    if it was not made by pdrom: it has neither an intact checksum nor the text `MARK`.
    """
    target = Path(path)
    _require_file(target)
    above = next((folder for folder in target.parents if folder.exists()), Path())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        fault = "no permission to write" if above.is_dir() else "not a folder"
        raise StorageError(f"{target}: cannot be written ({above}: {fault})")
    if not target.is_file():
        return
    hdf5 = sums.is_hdf5(target)
    if sums.read_checksum(target) if hdf5 else check_file(target) is Condition.INTACT:
        return
    with open(target, "rb") as handle:
        begin = handle.read(MARKED)
        handle.seek(max(0, target.stat().st_size - MARKED))
        if MARK not in begin and MARK not in handle.read():
            fault = "a file that pdrom has not made; move it away"
            raise StorageError(f"{target}: cannot be written ({fault})")


def _require_file(target: Path) -> None:
    try:
        mode = target.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({reason(error)})") from error
    if not stat.S_ISREG(mode):
        link = "a link; name the file itself" if stat.S_ISLNK(mode) else "no regular file"
        kind = "a folder" if stat.S_ISDIR(mode) else link
        raise StorageError(f"{target}: cannot be written ({kind})")


def _remove_leftovers(target: Path) -> None:
    """Remove temporary files of ``target`` from processes of this machine that have ended."""
    stem, suffix, checksum = map(re.escape, (target.stem, target.suffix, sums.CHECKSUM_SUFFIX))
    name = re.compile(rf"\.{stem}\.{_MACHINE}([0-9a-f]{{8}})[0-9a-f]{{4}}{suffix}({checksum})?")
    for path in target.parent.iterdir():
        found = name.fullmatch(path.name)
        if found and not _runs(int(found[1], 16)):
            path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except OSError as error:  # PermissionError: the process exists, but belongs to another user
        return isinstance(error, PermissionError)
    return True


def _bring_to_disk(path: Path) -> None:
    with open(path, "rb") as handle:
        os.fsync(handle.fileno())


def write_text(text: str, path: str | os.PathLike[str], with_checksum: bool = True) -> None:
    """Write ``text`` as UTF-8 to ``path``; ``with_checksum`` adds a checksum file."""
    with atomic_path(path, with_checksum) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_text(path: str | os.PathLike[str]) -> str:
    """Read the file ``path`` that `write_text` wrote; StorageError if missing or damaged."""
    require_intact(path)
    return Path(path).read_text(encoding="utf-8")


def write_table(table: "pd.DataFrame", path: str | os.PathLike[str]) -> None:
    """Write ``table`` as CSV to ``path``: floats with 10 digits, missing values as empty cells."""
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.10g", lineterminator="\n")


def read_table(
    path: str | os.PathLike[str], columns: Sequence[str] | None = None, result: bool = True
) -> "pd.DataFrame":
    """Read the CSV table ``path``; StorageError if missing, damaged or without one of ``columns``.

    ``result`` tells whether the pipeline wrote the table, so that its checksum must be checked.
    """
    import pandas as pd

    if result:
        require_intact(path)
    try:
        content = Path(path).read_bytes()
        table = pd.read_csv(io.BytesIO(content))
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error
    except (ValueError, OverflowError) as error:
        fault = " ".join(str(error).split())
        raise StorageError(f"{path}: not a readable table ({fault})") from error
    if not content.endswith(b"\n"):
        raise StorageError(f"{path}: the end of its last line is missing")
    missing = [name for name in columns or () if name not in table.columns]
    if missing:
        raise StorageError(f"{path}: lacks the column(s) {', '.join(missing)}")
    return table


def require_finite(name: str, array: np.ndarray, error: type[Exception]) -> np.ndarray:
    """Return ``array`` if finite, else raise ``error`` with ``name`` and the first bad entry."""
    finite = np.isfinite(array)
    if not finite.all():
        first = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise error(f"{name}: entry {first} is {array[first]}, finite numbers are required")
    return array


@contextmanager
def write_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Yield a new HDF5 file without time stamps, in memory; then write it with a checksum."""
    with atomic_path(path, with_checksum=False) as temporary:
        memory = _Memory()
        with h5py.File(memory, "w", track_order=True, userblock_size=sums.BLOCK) as file:
            file.attrs.update(attributes())
            yield file
        with temporary.open("wb") as target:
            target.write(memory.getbuffer())
        sums.write_block(temporary, path)


class _Memory(io.BytesIO):
    """File in memory: HDF5 on a full disk would crash when the process ends."""

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size; as on a disk, zeros fill a longer file."""
        if size is not None:
            self.write(bytes(max(0, size - self.seek(0, io.SEEK_END))))
        return super().truncate(size)


@contextmanager
def open_hdf5(path: str | os.PathLike[str], unchecked: bool = False) -> Iterator[h5py.File]:
    """Open the result ``path`` (HDF5) for reading, if it matches its checksum.

    Raises StorageError if it is missing, damaged, or lacks a dataset or attribute that is read. A
    file without a checksum is read if ``unchecked``.
    """
    require_intact(path, unchecked)
    try:
        with h5py.File(path, "r") as file:
            yield file
    except KeyError as error:
        raise StorageError(f"{path}: {error.args[0]}") from error
    except OSError as error:
        require_intact(path, unchecked)  # refuses a file damaged since the check above
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error


def require_self_contained(file: h5py.File, path: str | os.PathLike[str]) -> None:
    """Raise StorageError if ``file`` (at ``path``) has links, external storage or virtual data."""

    def outside(name: str, found: Any) -> str | None:
        elsewhere = isinstance(found, h5py.Dataset) and (found.is_virtual or found.external)
        inside = isinstance(found, (h5py.HardLink, h5py.Group, h5py.Dataset)) and not elsewhere
        return None if inside else name

    if name := file.visititems_links(outside) or file.visititems(outside):
        raise StorageError(f"{path}: {name} refers to data outside this file")
