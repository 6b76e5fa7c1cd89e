"""A file that takes its name only when it is complete, with a checksum file if it needs one."""

import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.store.checksum import (
    CHECKSUM_SUFFIX,
    checksum_path,
    digest_of,
    new_checksum,
    reason,
)


@contextmanager
def atomic_path(path: str | os.PathLike[str], with_checksum: bool = True) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; checksum and rename it on success, else remove it.

    What a killed process left of the same target is removed first: one job at a time makes a file.

    Parameters
    ----------
    with_checksum : whether a checksum file lies beside it; not so for a file that has its checksum
        inside, or that goes into a user's own folder

    Raises
    ------
    StorageError
        The folder or the file cannot be written: no permission, no space.
    """
    target = Path(path)
    _require_no_folder(target)
    temporary = target.with_name(f".{target.stem}.{uuid.uuid4().hex[:12]}{target.suffix}")
    checksum = temporary.with_name(f"{temporary.name}{CHECKSUM_SUFFIX}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(target)
        yield temporary
        _bring_to_disk(temporary)
        if with_checksum:
            checksum.write_bytes(new_checksum(digest_of(temporary), target.name).content)
            _bring_to_disk(checksum)
            _rename(temporary, checksum, target)
        else:
            os.replace(temporary, target)
            checksum_path(target).unlink(missing_ok=True)  # of an earlier file
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({reason(error)})") from error
    finally:
        for left in (temporary, checksum):
            with suppress(OSError):
                left.unlink(missing_ok=True)


def require_place(path: str | os.PathLike[str]) -> None:
    """Refuse a ``path`` that cannot be written, before a long computation of what goes there.

    Raises
    ------
    StorageError
        A folder is in the place of the file, or its own folder cannot be made or written to.
    """
    target = Path(path)
    _require_no_folder(target)
    above = next((folder for folder in target.parents if folder.exists()), Path())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        fault = "no permission to write" if above.is_dir() else "not a folder"
        raise StorageError(f"{target}: cannot be written ({above}: {fault})")


def _require_no_folder(target: Path) -> None:
    try:
        folder = target.is_dir()
    except OSError as error:
        raise StorageError(f"{target}: cannot be written ({reason(error)})") from error
    if folder:
        raise StorageError(f"{target}: cannot be written (a folder)")


def _remove_leftovers(target: Path) -> None:
    stem, suffix, checksum = map(re.escape, (target.stem, target.suffix, CHECKSUM_SUFFIX))
    name = re.compile(rf"\.{stem}\.[0-9a-f]{{12}}{suffix}({checksum})?")
    for path in target.parent.iterdir():
        if name.fullmatch(path.name):
            path.unlink(missing_ok=True)


def _bring_to_disk(path: Path) -> None:
    with open(path, "rb") as handle:
        os.fsync(handle.fileno())


def _rename(temporary: Path, checksum: Path, target: Path) -> None:
    """Give both files their names, the checksum first.

    A process killed in between leaves no file, or an older one that its checksum does not fit: both
    are made again. In the other order it would leave a good file without a checksum. Where the
    second name is refused, the older file keeps its own checksum.
    """
    place = checksum_path(target)
    previous = place.read_bytes() if place.is_file() else None
    os.replace(checksum, place)
    try:
        os.replace(temporary, target)
    except BaseException:
        if previous is None:
            place.unlink()
        else:
            place.write_bytes(previous)
        raise
