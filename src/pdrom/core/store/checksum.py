"""Checksums of result files, stored with each file's provenance, and checks of files by them.

An HDF5 file begins with a user block, which readers of HDF5 skip. It consists of a line that names
its format, the checksum of all bytes after the block, and zeros. So a copy of the file, in any
folder, can be checked for damage before HDF5 reads it.

Every other result has a hidden checksum file next to it, for ``t.csv`` named ``.t.csv.blake2b``.
Its last line has the format of the program ``b2sum``: the BLAKE2b digest of the result's bytes and
the result's name. The line above is a comment to that program; it contains the provenance
(`pdrom.core.provenance`) and a digest of the provenance.

Any difference, in the file or in its checksum, counts as damage.
"""

import errno
import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from pdrom.core.errors import StorageError, reason
from pdrom.core.provenance import provenance

# Whether reading a damaged result renames it: True inside the context `damaged_set_aside`.
_ASIDE: ContextVar[bool] = ContextVar("damaged results are set aside", default=False)
sets_aside = _ASIDE.get


@contextmanager
def damaged_set_aside() -> Iterator[None]:
    """Rename a damaged result to ``NAME.damaged`` when it is read in this context.

    It also renames a result whose checksum names another path, such as that of another scene.
    Only jobs of the workflow use it: the next run makes the missing result again. Other readers
    never rename a file, since it may be a user's only copy of a run.
    """
    previous = _ASIDE.set(True)
    try:
        yield
    finally:
        _ASIDE.reset(previous)


CHECKSUM_SUFFIX = ".blake2b"
_SHORT = 16  # number of hexadecimal digits that are kept of the digest of the provenance
SUFFIXES = (".h5", ".hdf5")
BLOCK = 2048  # bytes of the user block; HDF5 allows powers of two, at least 512
_LINE = b"pdrom: BLAKE2b of the bytes behind the first 2048, and what made them\n"
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
BLOCK_NAME = "-"  # file name that `tail -c +2049 FILE | b2sum` prints for standard input
UNCHECKED = "--unchecked (in Python unchecked=True) reads it if its data are valid"


@dataclass(frozen=True)
class Checksum:
    """Content of a checksum file: digest, name and provenance (JSON, may be empty) of a result."""

    digest: str
    name: str
    provenance: str

    @property
    def file(self) -> str:
        """Path of the result for which a job of the workflow wrote it; empty without a job."""
        return str(json.loads(self.provenance or "{}").get("file", ""))

    @property
    def content(self) -> bytes:
        """Bytes of the checksum file."""
        text = self.provenance.encode()
        short = hashlib.blake2b(text).hexdigest()[:_SHORT]
        comment = f"# {short} ".encode() + text + b"\n" if text else b""
        return comment + f"{self.digest}  {self.name}\n".encode()

    @classmethod
    def parse(cls, content: bytes) -> "Checksum":
        """Parse the bytes ``content``; damaged bytes give a checksum that matches no file."""
        first, _, rest = content.partition(b"\n")
        commented = first.startswith(b"# ")
        words = (rest if commented else content).decode(errors="replace").split()
        text = first[len("# ") + _SHORT + 1 :].decode(errors="replace") if commented else ""
        return cls(words[0] if words else "", words[-1] if words else "", text)


def checksum_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of the checksum file of ``path``, for files without a checksum inside."""
    return Path(path).with_name(f".{Path(path).name}{CHECKSUM_SUFFIX}")


def digest_of(path: Path, start: int = 0) -> str:
    """Compute the hexadecimal BLAKE2b digest of the bytes of ``path`` from ``start`` on."""
    with open(path, "rb") as handle:
        handle.seek(start)
        return hashlib.file_digest(handle, "blake2b").hexdigest()


def new_checksum(digest: str, name: str, path: str | os.PathLike[str] = "") -> Checksum:
    """Make the checksum ``name`` of ``path``: ``digest`` of its bytes, current provenance."""
    return Checksum(digest, name, json.dumps(provenance(path), sort_keys=True))


def is_hdf5(path: Path) -> bool:
    """Tell whether ``path`` has a suffix or signature of HDF5, or begins with pdrom's checksum."""
    with open(path, "rb") as handle:
        head = handle.read(BLOCK + len(_SIGNATURE))
    named = path.suffix in SUFFIXES or head.startswith((_SIGNATURE, _LINE))
    return named or head[BLOCK:] == _SIGNATURE


def write_block(path: Path, target: str | os.PathLike[str] = "") -> None:
    """Write the checksum of the HDF5 file ``path`` into its user block of `BLOCK` bytes.

    ``target`` is the path that the file will have.
    """
    content = _LINE + new_checksum(digest_of(path, BLOCK), BLOCK_NAME, target or path).content
    if len(content) > BLOCK:
        raise ValueError(f"{path}: a checksum of {len(content)} bytes, allowed: at most {BLOCK}")
    with open(path, "r+b") as handle:
        handle.write(content.ljust(BLOCK, b"\0"))


class Condition(StrEnum):
    """Result of comparing a file with its checksum."""

    INTACT = "intact"
    DAMAGED = "damaged"
    NO_CHECKSUM = "no checksum"


def read_checksum(path: str | os.PathLike[str]) -> Checksum | None:
    """Read the checksum of the file ``path``; None if it is missing, damaged or not readable."""
    path = Path(path)
    content = _checksum_bytes(path) if path.is_file() and os.access(path, os.R_OK) else None
    checksum = Checksum.parse(content or b"")
    return checksum if checksum.content == content else None


def provenance_of(path: str | os.PathLike[str]) -> dict[str, str]:
    """Return the provenance of ``path`` from its checksum; empty without a valid checksum."""
    checksum = read_checksum(path)
    return json.loads(checksum.provenance) if checksum and checksum.provenance else {}


def check_file(path: str | os.PathLike[str]) -> Condition:
    """Compare the result ``path`` of any kind with its checksum, without changing any file.

    Raises StorageError if there is no such file, or it may not be read.
    """
    path = Path(path)
    try:
        if not path.is_file():
            raise StorageError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
        if _checksum_bytes(path) is None:
            return Condition.NO_CHECKSUM
        start, name = (BLOCK, BLOCK_NAME) if is_hdf5(path) else (0, path.name)
        told = read_checksum(path)
        fits = told and (told.digest, told.name) == (digest_of(path, start), name)
        return Condition.INTACT if fits else Condition.DAMAGED
    except OSError as error:
        if error.errno == errno.EIO:  # the disk cannot read a part of the file
            return Condition.DAMAGED
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error


def require_intact(path: str | os.PathLike[str], unchecked: bool = False) -> None:
    """Refuse a result ``path`` that does not match its checksum; every reader calls this first.

    Raises StorageError if the file is missing, cannot be read, is damaged or (if not ``unchecked``)
    has no checksum, or if a job of the workflow (`damaged_set_aside`) reads another job's file.
    """
    path = Path(path)
    readable = path.is_file() and os.access(path, os.R_OK)
    if sets_aside() and os.path.lexists(path) and not readable:
        raise _set_aside(path, "damaged, no file that can be read")
    condition = check_file(path)
    if condition is Condition.INTACT and sets_aside():
        told = read_checksum(path)
        if told and told.file != os.path.normpath(path):
            other = told.file or "its checksum names none"
            raise _set_aside(path, f"the file of another result ({other})")
    if condition is Condition.INTACT or (unchecked and condition is Condition.NO_CHECKSUM):
        return
    if condition is Condition.DAMAGED:
        fault = "damaged, its content and its checksum differ (a disk fault, an edit?)"
    elif is_hdf5(path):
        fault = "no checksum inside (written by an older pdrom, or by another program?)"
    else:
        fault = f"its checksum {checksum_path(path).name} is missing (copied without it?)"
    if sets_aside():
        raise _set_aside(path, fault if fault.startswith("damaged") else f"damaged, {fault}")
    way = f"; {UNCHECKED}" if condition is Condition.NO_CHECKSUM and is_hdf5(path) else ""
    raise StorageError(f"{path}: {fault}{way}")


def _checksum_bytes(path: Path) -> bytes | None:
    """Bytes of the checksum in or next to ``path``: b"" if damaged, None if there is none."""
    if not is_hdf5(path):
        place = checksum_path(path)
        return place.read_bytes() if place.is_file() else None
    with open(path, "rb") as handle:
        block = handle.read(BLOCK)
    if block.startswith(_SIGNATURE):
        return None
    return block.removeprefix(_LINE).rstrip(b"\0") if block.startswith(_LINE) else b""


def digest_told(path: str | os.PathLike[str]) -> str:
    """Return the digest of the result ``path`` from its checksum; "" without a valid checksum.

    A job of the workflow refuses another result, as `require_intact` does.
    """
    told = read_checksum(path)
    if sets_aside() and (told is None or told.file != os.path.normpath(path)):
        require_intact(path)
    return told.digest if told else ""


def move_aside(path: str | os.PathLike[str]) -> str:
    """Rename ``path``, also a folder or link, to ``NAME.damaged``; return a message about it."""
    path = Path(path)
    aside, checksum = path.with_name(f"{path.name}.damaged"), checksum_path(path)
    try:
        os.replace(path, aside)
        checksum.unlink(missing_ok=True)
    except OSError as error:
        return f"; delete it, it cannot be renamed ({reason(error)})"
    return f"; renamed to {aside.name}"


def _set_aside(path: Path, fault: str) -> StorageError:
    return StorageError(f"{path}: {fault}{move_aside(path)}, the next run makes it again")
