"""Checksum inside an HDF5 file: its first bytes, which HDF5 leaves to its users (the user block).

The block holds a line that names the format, the checksum (`pdrom.core.store.checksum`) of all
bytes behind the block, and zeros. So a copy of the file, wherever it lies, shows by itself whether
it is whole, before HDF5 reads any of it; every reader of HDF5 skips the block.
"""

from pathlib import Path

from pdrom.core.store.checksum import digest_of, new_checksum

SUFFIXES = (".h5", ".hdf5")
SIZE = 2048  # bytes; HDF5 allows powers of two from 512 on
_LINE = b"pdrom: BLAKE2b of the bytes behind the first 2048, and what made them\n"
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
NAME = "-"  # of what `tail -c +2049 FILE | b2sum` reads


def is_hdf5(path: Path) -> bool:
    """Whether the file ``path`` is HDF5, by its name or its beginning, with a block or without."""
    with open(path, "rb") as handle:
        head = handle.read(SIZE + len(_SIGNATURE))
    named = path.suffix in SUFFIXES or head.startswith((_SIGNATURE, _LINE))
    return named or head[SIZE:] == _SIGNATURE


def write_block(path: Path) -> None:
    """Checksum a complete HDF5 file ``path`` that begins with ``SIZE`` bytes of no meaning."""
    content = _LINE + new_checksum(digest_of(path, start=SIZE), NAME).content
    if len(content) > SIZE:
        raise ValueError(f"{path}: a checksum of {len(content)} bytes, allowed: at most {SIZE}")
    with open(path, "r+b") as handle:
        handle.write(content.ljust(SIZE, b"\0"))


def read_block(path: Path) -> bytes | None:
    """Checksum's bytes in the HDF5 file ``path``, b"" if damaged; None without a block."""
    with open(path, "rb") as handle:
        block = handle.read(SIZE)
    if block.startswith(_SIGNATURE):
        return None
    return block.removeprefix(_LINE).rstrip(b"\0") if block.startswith(_LINE) else b""
