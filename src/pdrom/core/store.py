"""Reading and writing results: atomic, deterministic, with clear errors.

A result is written to a temporary file beside its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one. An HDF5 file ends
with the checksum of all bytes before it, so that a changed bit is noticed when the file is read. A
table is plain text without one: only what makes it unreadable or cuts its last line is noticed.

A damaged file is set aside when it is read: the next run finds it missing and makes it anew.
"""

import errno
import io
import os
import re
import uuid
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from pdrom.core.errors import StorageError

FLOAT_FORMAT = "%.10g"
# HDF5 ignores what follows its own end of the file.
_SEAL = b"pdrom-crc32:%08x\n"
_SEAL_BYTES = len(_SEAL % 0)
_BLOCK = 1 << 20


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; rename it on success, remove it on failure.

    What a killed process left of the same target is removed first: one job at a time makes a file.

    Raises
    ------
    StorageError
        The folder or the file cannot be written: no permission, no space.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}.{uuid.uuid4().hex[:12]}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(target)
        yield temporary
        with open(temporary, "rb") as handle:
            os.fsync(handle.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({_reason(error)})") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _remove_leftovers(target: Path) -> None:
    name = re.compile(rf"\.{re.escape(target.stem)}\.[0-9a-f]{{12}}{re.escape(target.suffix)}")
    for path in target.parent.iterdir():
        if name.fullmatch(path.name):
            path.unlink(missing_ok=True)


def _reason(error: OSError) -> str:
    """Words of the operating system; HDF5 hides the number in a long text."""
    hidden = re.search(r"errno = (\d+)", str(error))
    number = error.errno or (int(hidden[1]) if hidden else 0)
    return os.strerror(number) if number in errno.errorcode else " ".join(str(error).split())[:200]


@contextmanager
def write_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Yield a new HDF5 file that takes its name only when complete; no time stamps inside."""
    with atomic_path(path) as temporary:
        with open(temporary, "w+b", buffering=0) as handle:
            sink = _Sink(handle)
            with h5py.File(sink, "w", track_order=True) as file:
                yield file
        if sink.error is not None:
            raise sink.error
        seal = _SEAL % _checksum(temporary, temporary.stat().st_size)
        with open(temporary, "ab") as handle:
            handle.write(seal)


class _Sink:
    """File that HDF5 writes to; it never fails.

    HDF5 does not survive an error while it writes: it cannot close the file and crashes when the
    process ends. So the first error (no space, say) is kept for later and the rest thrown away.
    """

    def __init__(self, handle: io.FileIO) -> None:
        self._handle = handle
        self.error: OSError | None = None
        for name in ("read", "seek", "tell", "flush"):
            setattr(self, name, getattr(handle, name))

    def write(self, data: memoryview) -> int:
        left = memoryview(data)
        while len(left) and self.error is None:
            try:
                left = left[self._handle.write(left) :]
            except OSError as error:
                self.error = error
        return len(data)

    def readinto(self, buffer: memoryview) -> int:
        count = self._handle.readinto(buffer)
        buffer[count:] = bytes(len(buffer) - count)  # what was thrown away
        return len(buffer)

    def truncate(self, size: int) -> int:
        if self.error is None:
            try:
                return self._handle.truncate(size)
            except OSError as error:
                self.error = error
        return size


def _checksum(path: Path, size: int) -> int:
    """CRC-32 of the first ``size`` bytes."""
    value = 0
    with open(path, "rb") as handle:
        while size > 0 and (block := handle.read(min(size, _BLOCK))):
            value = zlib.crc32(block, value)
            size -= len(block)
    return value


def _check_seal(path: Path) -> None:
    size = path.stat().st_size - _SEAL_BYTES
    with open(path, "rb") as handle:
        handle.seek(max(size, 0))
        seal = handle.read()
    if not re.fullmatch(rb"pdrom-crc32:[0-9a-f]{8}\n", seal):
        # cut, or written by another program: HDF5 knows where its file ends
        if not h5py.is_hdf5(path) or not _opens(path):
            raise _damaged(path, "its end is missing")
    elif seal != _SEAL % _checksum(path, size):
        raise _damaged(path, "its checksum does not match its content")


def _opens(path: Path) -> bool:
    try:
        h5py.File(path, "r").close()
    except OSError:
        return False
    return True


def _damaged(path: Path, fault: str, result: bool = True) -> StorageError:
    """Set a damaged result aside and say so."""
    if not result:
        return StorageError(f"{path}: damaged, {fault}")
    aside = path.with_name(f"{path.name}.damaged")
    try:
        os.replace(path, aside)
    except OSError:
        return StorageError(f"{path}: damaged, {fault}; delete it, the next run makes it anew")
    return StorageError(
        f"{path}: damaged, {fault}; set aside as {aside.name}, the next run makes it anew"
    )


@contextmanager
def open_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading.

    Raises
    ------
    StorageError
        If the file is missing, truncated or changed, or lacks a dataset or attribute that is read
        from it.
    """
    if not Path(path).is_file():
        raise StorageError(f"{path}: no such file")
    try:
        _check_seal(Path(path))
        file = h5py.File(path, "r")
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({_reason(error)})") from error
    with file:
        try:
            yield file
        except KeyError as error:
            raise StorageError(f"{path}: {error.args[0]}") from error
        except OSError as error:
            raise StorageError(f"{path}: cannot be read to its end ({error})") from error


def write_table(table: pd.DataFrame, path: str | os.PathLike[str]) -> None:
    """Write a table as CSV: fixed float format, an empty cell where there is no value."""
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def read_table(
    path: str | os.PathLike[str], columns: Sequence[str] | None = None, result: bool = True
) -> pd.DataFrame:
    """Read a CSV table; StorageError if it is missing, damaged or lacks one of ``columns``.

    ``result`` says that a run can make the table anew, so that a damaged one is set aside.
    """
    if not Path(path).is_file():
        raise StorageError(f"{path}: no such file")
    try:
        content = Path(path).read_bytes()
        table = pd.read_csv(io.BytesIO(content))
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({_reason(error)})") from error
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        fault = f"not a readable table ({' '.join(str(error).split())})"
        raise _damaged(Path(path), fault, result) from error
    if not content.endswith(b"\n") or b"\0" in content:
        raise _damaged(Path(path), "its end is missing or it is no text", result)
    missing = [name for name in columns or () if name not in table.columns]
    if missing:
        raise StorageError(f"{path}: lacks the column(s) {', '.join(missing)}")
    return table


def require_finite(name: str, array: np.ndarray, error: type[Exception]) -> np.ndarray:
    """Return ``array`` or raise ``error`` naming the first entry that is NaN or infinite."""
    finite = np.isfinite(array)
    if not finite.all():
        first = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise error(f"{name}: entry {first} is {array[first]}, finite numbers are required")
    return array
