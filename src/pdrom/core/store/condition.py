"""Whether a file is what was written: its bytes and its checksum are compared.

The checksum is compared whole with the one that the file's bytes give now. Whatever differs, in the
file or in its checksum, is damage; a changed file whose checksum changed with it would have to meet
a digest of 512 bits.
"""

import errno
import json
import os
from enum import StrEnum
from pathlib import Path

from pdrom.core.aside import sets_aside
from pdrom.core.errors import StorageError
from pdrom.core.store.block import NAME, SIZE, is_hdf5, read_block
from pdrom.core.store.checksum import Checksum, checksum_path, digest_of
from pdrom.core.store.oserrors import reason

UNCHECKED = "--unchecked (in Python unchecked=True) reads it if it is sound"


class Condition(StrEnum):
    """Result of comparing a file with its checksum."""

    INTACT = "intact"
    DAMAGED = "damaged"
    NO_CHECKSUM = "no checksum"


def read_checksum(path: str | os.PathLike[str]) -> Checksum | None:
    """Checksum of the file ``path``; None where there is none or it is damaged itself."""
    path = Path(path)
    content = _checksum_bytes(path) if path.is_file() else None
    if content is None:
        return None
    checksum = Checksum.parse(content)
    return checksum if checksum.content == content else None


def provenance_of(path: str | os.PathLike[str]) -> dict[str, str]:
    """Provenance of the file ``path``, kept with its checksum; empty where there is none."""
    checksum = read_checksum(path)
    return json.loads(checksum.provenance) if checksum and checksum.provenance else {}


def check_file(path: str | os.PathLike[str]) -> Condition:
    """Whether the bytes of the result ``path`` of any kind are as written; changes nothing.

    Raises
    ------
    StorageError
        There is no such file, or it may not be read.
    """
    path = Path(path)
    try:
        if not path.is_file():
            raise StorageError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
        if _checksum_bytes(path) is None:
            return Condition.NO_CHECKSUM
        start, name = (SIZE, NAME) if is_hdf5(path) else (0, path.name)
        checksum = read_checksum(path)
        fits = checksum is not None and (checksum.digest, checksum.name) == (
            digest_of(path, start),
            name,
        )
        return Condition.INTACT if fits else Condition.DAMAGED
    except OSError as error:
        if error.errno == errno.EIO:  # the disk has lost some of it
            return Condition.DAMAGED
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error


def require_intact(path: str | os.PathLike[str], unchecked: bool = False) -> None:
    """Refuse a result ``path`` that is not what was written; every reader calls this first.

    Parameters
    ----------
    unchecked : whether a file without a checksum will do

    Raises
    ------
    StorageError
        The file is missing or may not be read; or it is damaged or has no checksum. In a job of the
        workflow it was then set aside as ``*.damaged``, so that the next run finds it missing and
        makes it again; everywhere else it stays where it is.
    """
    path = Path(path)
    condition = check_file(path)
    if condition is Condition.INTACT or (unchecked and condition is Condition.NO_CHECKSUM):
        return
    if condition is Condition.DAMAGED:
        fault = "damaged, its content and its checksum differ (a disk fault, an edit?)"
    elif is_hdf5(path):
        fault = "no checksum inside (written by an older pdrom, or by another program?)"
    else:
        fault = f"its checksum {checksum_path(path).name} is missing (copied without it?)"
    if sets_aside():
        raise _set_aside(path, fault)
    way = f"; {UNCHECKED}" if condition is Condition.NO_CHECKSUM and is_hdf5(path) else ""
    raise StorageError(f"{path}: {fault}{way}")


def _checksum_bytes(path: Path) -> bytes | None:
    if is_hdf5(path):
        return read_block(path)
    place = checksum_path(path)
    return place.read_bytes() if place.is_file() else None


def _set_aside(path: Path, fault: str) -> StorageError:
    damage = fault if fault.startswith("damaged") else f"damaged, {fault}"
    aside = path.with_name(f"{path.name}.damaged")
    try:
        os.replace(path, aside)
        checksum_path(path).unlink(missing_ok=True)
    except OSError:
        return StorageError(f"{path}: {damage}; delete it, the next run makes it again")
    return StorageError(f"{path}: {damage}; set aside as {aside.name}, the next run makes it again")
