"""HDF5 files, deterministic, each with the checksum of all bytes at its end."""

import io
import os
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from pdrom.core.errors import StorageError
from pdrom.core.store.atomic import atomic_path, reason
from pdrom.core.store.damage import damaged

# HDF5 ignores what follows its own end of the file.
_SEAL = b"pdrom-crc32:%08x\n"
_SEAL_BYTES = len(_SEAL % 0)
_BLOCK = 1 << 20


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
            raise damaged(path, "its end is missing")
    elif seal != _SEAL % _checksum(path, size):
        raise damaged(path, "its checksum does not match its content")


def _opens(path: Path) -> bool:
    try:
        h5py.File(path, "r").close()
    except OSError:
        return False
    return True


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
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error
    with file:
        try:
            yield file
        except KeyError as error:
            raise StorageError(f"{path}: {error.args[0]}") from error
        except OSError as error:
            raise StorageError(f"{path}: cannot be read to its end ({error})") from error
