"""What becomes of a damaged result: it is set aside, so that the next run makes it anew."""

import os
from pathlib import Path

from pdrom.core.errors import StorageError


def damaged(path: Path, fault: str, result: bool = True) -> StorageError:
    """Set a damaged result aside and say so."""
    if not result:
        return StorageError(f"{path}: damaged, {fault}")
    aside = path.with_name(f"{path.name}.damaged")
    try:
        os.replace(path, aside)
    except OSError:
        return StorageError(f"{path}: damaged, {fault}; delete it, the next run makes it anew")
    return StorageError(
        f"{path}: damaged, {fault}; set aside as {aside.name}, the next run makes it anew"
    )
