"""Reading and writing results: atomic, deterministic, with clear errors.

A result is written to a temporary file beside its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one.
"""

import os
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from pdrom.errors import StorageError

FLOAT_FORMAT = "%.10g"


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; rename it on success, remove it on failure."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.stem}.{uuid.uuid4().hex[:12]}{target.suffix}")
    try:
        yield temporary
        with open(temporary, "rb") as handle:
            os.fsync(handle.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({error.strerror or error})") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def write_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Yield a new HDF5 file that takes its name only when complete; no time stamps inside."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w", track_order=True) as file:
        yield file


@contextmanager
def open_hdf5(path: str | os.PathLike[str]) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading.

    Raises
    ------
    StorageError
        If the file is missing, truncated, or lacks a dataset or attribute that is read from it.
    """
    if not Path(path).is_file():
        raise StorageError(f"{path}: no such file")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise StorageError(f"{path}: not a complete HDF5 file ({error})") from error
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


def read_table(path: str | os.PathLike[str], columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read a CSV table; StorageError if it is missing, empty or lacks one of ``columns``."""
    if not Path(path).is_file():
        raise StorageError(f"{path}: no such file")
    try:
        table = pd.read_csv(path)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise StorageError(f"{path}: not a readable table ({error})") from error
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
