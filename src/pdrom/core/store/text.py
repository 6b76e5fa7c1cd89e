"""Plain text, tables as CSV, and the check that numbers are finite."""

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store.atomic import atomic_path
from pdrom.core.store.checksum import reason, require_intact

if TYPE_CHECKING:  # a run without tables does not load it
    import pandas as pd


def write_text(text: str, path: str | os.PathLike[str], with_checksum: bool = True) -> None:
    """Write ``text`` as UTF-8 to ``path``; ``with_checksum`` as in `atomic_path`."""
    with atomic_path(path, with_checksum) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_text(path: str | os.PathLike[str]) -> str:
    """Read the file ``path`` by `write_text`; StorageError if it is missing or damaged."""
    require_intact(path)
    return Path(path).read_text(encoding="utf-8")


FLOAT_FORMAT = "%.10g"


def write_table(
    table: "pd.DataFrame", path: str | os.PathLike[str], with_checksum: bool = True
) -> None:
    """Write a table as CSV to ``path``: fixed float format, an empty cell for no value."""
    with atomic_path(path, with_checksum) as temporary:
        table.to_csv(temporary, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def read_table(
    path: str | os.PathLike[str], columns: Sequence[str] | None = None, result: bool = True
) -> "pd.DataFrame":
    """Read the CSV table ``path``; StorageError if missing, damaged or without one of ``columns``.

    ``result`` marks a table that a run wrote, with a checksum; other tables have none.
    """
    import pandas as pd

    if result:
        require_intact(path)
    try:
        content = Path(path).read_bytes()
        table = pd.read_csv(io.BytesIO(content))
    except FileNotFoundError as error:
        raise StorageError(f"{path}: no such file") from error
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        fault = " ".join(str(error).split())
        raise StorageError(f"{path}: not a readable table ({fault})") from error
    if not content.endswith(b"\n"):
        raise StorageError(f"{path}: the end of its last line is missing")
    missing = [name for name in columns or () if name not in table.columns]
    if missing:
        raise StorageError(f"{path}: lacks the column(s) {', '.join(missing)}")
    return table


def require_finite(name: str, array: np.ndarray, error: type[Exception]) -> np.ndarray:
    """Return ``array``, or raise ``error`` with ``name`` and its first entry that is not finite."""
    finite = np.isfinite(array)
    if not finite.all():
        first = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise error(f"{name}: entry {first} is {array[first]}, finite numbers are required")
    return array
