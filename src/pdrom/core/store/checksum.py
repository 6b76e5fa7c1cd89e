"""Checksums of results, with what made the result.

An HDF5 file has its checksum inside (`pdrom.core.store.block`). Beside every other result lies a
hidden checksum file: that of ``t.csv`` is ``.t.csv.blake2b``, in the format of the program
``b2sum``: the BLAKE2b digest of the file's bytes and the file's name. The line before it is a
comment to that program; it holds the provenance (`pdrom.core.provenance`) with a digest of its own.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

from pdrom.core.provenance import as_text, provenance

CHECKSUM_SUFFIX = ".blake2b"
_SHORT = 16  # hexadecimal digits of the checksum of a comment


@dataclass(frozen=True)
class Checksum:
    """Content of a checksum file: digest and name of the result, provenance as JSON or nothing."""

    digest: str
    name: str
    provenance: str

    @property
    def content(self) -> bytes:
        """Bytes of the checksum file."""
        text = self.provenance.encode()
        short = hashlib.blake2b(text).hexdigest()[:_SHORT]
        comment = f"# {short} ".encode() + text + b"\n" if text else b""
        return comment + f"{self.digest}  {self.name}\n".encode()

    @classmethod
    def parse(cls, content: bytes) -> "Checksum":
        """Checksum read from these bytes; of damaged bytes, one whose content is another."""
        first, _, rest = content.partition(b"\n")
        commented = first.startswith(b"# ")
        words = (rest if commented else content).decode(errors="replace").split()
        text = first[len("# ") + _SHORT + 1 :].decode(errors="replace") if commented else ""
        return cls(words[0] if words else "", words[-1] if words else "", text)


def checksum_path(path: str | os.PathLike[str]) -> Path:
    """Path of the checksum file of ``path``, for files without a checksum inside."""
    return Path(path).with_name(f".{Path(path).name}{CHECKSUM_SUFFIX}")


def digest_of(path: Path, start: int = 0) -> str:
    """BLAKE2b digest of the bytes of the file ``path`` from ``start`` on, hexadecimal."""
    with open(path, "rb") as handle:
        handle.seek(start)
        return hashlib.file_digest(handle, "blake2b").hexdigest()


def new_checksum(digest: str, name: str) -> Checksum:
    """Checksum of a file ``name`` that is made now, with the ``digest`` of its bytes."""
    return Checksum(digest, name, as_text(provenance()))
