"""Seals: beside every result a hidden file with its checksum, and with what made it.

The seal of ``t.csv`` is ``.t.csv.blake2b``, in the format of the program ``b2sum``: the BLAKE2b
digest of the file's bytes and the file's name. The line before it is a comment to that program; it
holds the provenance (`pdrom.core.provenance`) with a checksum of its own. The seal is compared
whole with the one that the file's bytes give now. Whatever differs, in the file or in its seal, is
damage; a changed file whose seal changed with it would have to meet a digest of 512 bits.
"""

import errno
import hashlib
import json
import os
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.provenance import as_text, provenance
from pdrom.core.store.oserrors import reason

SEAL_SUFFIX = ".blake2b"
_SHORT = 16  # hexadecimal digits of the checksum of a comment


class Condition(StrEnum):
    """What a file and its seal say of each other."""

    INTACT = "intact"
    DAMAGED = "damaged"
    UNSEALED = "unsealed"


@dataclass(frozen=True)
class Seal:
    """What stands in a seal: digest and name of the file, provenance as JSON or nothing."""

    digest: str
    name: str
    provenance: str

    @property
    def content(self) -> bytes:
        """Bytes of the seal."""
        text = self.provenance.encode()
        short = hashlib.blake2b(text).hexdigest()[:_SHORT]
        comment = f"# {short} ".encode() + text + b"\n" if text else b""
        return comment + f"{self.digest}  {self.name}\n".encode()

    @classmethod
    def parse(cls, content: bytes) -> "Seal":
        """The seal of these bytes; of damaged ones, a seal whose content is another."""
        first, _, rest = content.partition(b"\n")
        commented = first.startswith(b"# ")
        words = (rest if commented else content).decode(errors="replace").split()
        text = first[len("# ") + _SHORT + 1 :].decode(errors="replace") if commented else ""
        return cls(words[0] if words else "", words[-1] if words else "", text)


def seal_path(path: str | os.PathLike[str]) -> Path:
    """Where the seal of ``path`` lies."""
    return Path(path).with_name(f".{Path(path).name}{SEAL_SUFFIX}")


def digest_of(path: Path, kind: str = "blake2b") -> str:
    """Digest of the bytes of a file, hexadecimal."""
    with open(path, "rb") as handle:
        return hashlib.file_digest(handle, kind).hexdigest()


def seal_of(path: Path, name: str) -> bytes:
    """The seal of the bytes that ``path`` holds, for a file called ``name`` that is made now."""
    return Seal(digest_of(path), name, as_text(provenance())).content


def read_seal(path: str | os.PathLike[str]) -> Seal | None:
    """The seal beside ``path``; None where there is none or it is damaged itself."""
    place = seal_path(path)
    if not place.is_file():
        return None
    content = place.read_bytes()
    seal = Seal.parse(content)
    return seal if seal.content == content else None


def provenance_of(path: str | os.PathLike[str]) -> dict[str, str]:
    """What made a file, as its seal says; nothing where that does not say it."""
    seal = read_seal(path)
    return json.loads(seal.provenance) if seal and seal.provenance else {}


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
        if not seal_path(path).is_file():
            return Condition.UNSEALED
        found = seal_path(path).read_bytes()
        expected = Seal(digest_of(path), path.name, Seal.parse(found).provenance)
        return Condition.INTACT if found == expected.content else Condition.DAMAGED
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
