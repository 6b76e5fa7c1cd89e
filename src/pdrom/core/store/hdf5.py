"""HDF5 files: the same bytes for the same content."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager

import h5py

from pdrom.core.errors import StorageError
from pdrom.core.provenance import attributes
from pdrom.core.store.atomic import atomic_path
from pdrom.core.store.checksum import BLOCK, reason, require_intact, write_block


@contextmanager
def write_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Yield a new HDF5 file; it takes its name ``path`` when complete, with a checksum.

    No time stamps are inside.
    """
    with atomic_path(path, with_checksum=False) as temporary:
        with open(temporary, "w+b", buffering=0) as handle:
            sink = _Sink(handle)
            with h5py.File(sink, "w", track_order=True, userblock_size=BLOCK) as file:
                file.attrs.update(attributes())
                yield file
            if sink.error is not None:
                raise sink.error
        write_block(temporary)


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
        buffer[count:] = bytes(len(buffer) - count)  # zeros for what `write` has dropped
        return len(buffer)

    def truncate(self, size: int) -> int:
        if self.error is None:
            try:
                return self._handle.truncate(size)
            except OSError as error:
                self.error = error
        return size


@contextmanager
def open_hdf5(path: str | os.PathLike[str], unchecked: bool = False) -> Iterator[h5py.File]:
    """Open the HDF5 file ``path`` of the results for reading.

    Its checksum is compared before HDF5 sees the file, so that damage is no error of HDF5.

    Parameters
    ----------
    unchecked : whether a file without a checksum is read

    Raises
    ------
    StorageError
        If the file is missing or damaged, or lacks a dataset or attribute that is read from it.
    """
    require_intact(path, unchecked)
    try:
        with h5py.File(path, "r") as file:
            yield file
    except KeyError as error:
        raise StorageError(f"{path}: {error.args[0]}") from error
    except OSError as error:
        require_intact(path, unchecked)  # refuses a file that was damaged since the first check
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error


def require_self_contained(file: h5py.File, path: str | os.PathLike[str]) -> None:
    """Refuse a ``file`` from elsewhere, at ``path``, that would read other files.

    Raises
    ------
    StorageError
        It has a soft or an external link, external storage or a virtual dataset.
    """
    groups: list[h5py.Group] = [file]
    seen: set[int] = set()
    while groups:
        group = groups.pop()
        place = h5py.h5o.get_info(group.id).addr
        for name in group if place not in seen else ():
            link = group.get(name, getlink=True)
            item = group[name] if isinstance(link, h5py.HardLink) else None
            if isinstance(item, h5py.Group):
                groups.append(item)
            elif not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
                raise StorageError(f"{path}: {name} is no data of this file but leads elsewhere")
        seen.add(place)
