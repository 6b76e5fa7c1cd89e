"""Seals: beside every result a hidden file with its checksum.

The seal of ``t.csv`` is ``.t.csv.blake2b``, one line in the format of the program ``b2sum``: the
BLAKE2b digest of the file's bytes and the file's name. It is compared whole with the line that the
file's bytes give now. Whatever differs, in the file or in its seal, is damage; a changed file whose
seal changed with it would have to meet a digest of 512 bits.
"""

import errno
import hashlib
import os
from enum import StrEnum
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.store.oserrors import reason

SEAL_SUFFIX = ".blake2b"


class Condition(StrEnum):
    """What a file and its seal say of each other."""

    INTACT = "intact"
    DAMAGED = "damaged"
    UNSEALED = "unsealed"


def seal_path(path: str | os.PathLike[str]) -> Path:
    """Where the seal of ``path`` lies."""
    return Path(path).with_name(f".{Path(path).name}{SEAL_SUFFIX}")


def seal_of(path: Path, name: str) -> bytes:
    """The seal of the bytes that ``path`` holds, for a file called ``name``."""
    with open(path, "rb") as handle:
        digest = hashlib.file_digest(handle, "blake2b").hexdigest()
    return f"{digest}  {name}\n".encode()


def check_file(path: str | os.PathLike[str]) -> Condition:
    """Whether the bytes of a result of any kind are those that were written; changes nothing.

    Raises
    ------
    StorageError
        There is no such file, or it may not be read.
    """
    path = Path(path)
    if not path.is_file():
        raise StorageError(f"{path}: no such file")
    try:
        expected = seal_of(path, path.name)
        if not seal_path(path).is_file():
            return Condition.UNSEALED
        return Condition.INTACT if seal_path(path).read_bytes() == expected else Condition.DAMAGED
    except OSError as error:
        if error.errno == errno.EIO:  # the disk has lost some of it
            return Condition.DAMAGED
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error


def require_intact(path: str | os.PathLike[str]) -> None:
    """Whoever reads a result asks this first.

    Raises
    ------
    StorageError
        The file is missing or may not be read; or it is damaged or has no seal: then it was set
        aside as ``*.damaged``, so that the next run finds it missing and makes it anew.
    """
    path = Path(path)
    match check_file(path):
        case Condition.DAMAGED:
            raise _set_aside(path, "its content and its checksum differ (a disk fault, an edit?)")
        case Condition.UNSEALED:
            fault = f"its checksum {seal_path(path).name} is missing (copied without it?)"
            raise _set_aside(path, fault)


def _set_aside(path: Path, fault: str) -> StorageError:
    aside = path.with_name(f"{path.name}.damaged")
    try:
        os.replace(path, aside)
        seal_path(path).unlink(missing_ok=True)
    except OSError:
        return StorageError(f"{path}: damaged, {fault}; delete it, the next run makes it anew")
    return StorageError(
        f"{path}: damaged, {fault}; set aside as {aside.name}, the next run makes it anew"
    )
