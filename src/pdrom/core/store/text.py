"""Plain text: records, and what TeX reads."""

import os
from pathlib import Path

from pdrom.core.store.atomic import atomic_path
from pdrom.core.store.condition import require_intact


def write_text(text: str, path: str | os.PathLike[str], with_checksum: bool = True) -> None:
    """Write ``text`` as UTF-8 to ``path``; ``with_checksum`` as in `atomic_path`."""
    with atomic_path(path, with_checksum) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_text(path: str | os.PathLike[str]) -> str:
    """Read the file ``path`` by `write_text`; StorageError if it is missing or damaged."""
    require_intact(path)
    return Path(path).read_text(encoding="utf-8")
