"""Tables as CSV."""

import io
import os
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store.atomic import atomic_path, reason
from pdrom.core.store.damage import damaged

FLOAT_FORMAT = "%.10g"


def write_table(table: pd.DataFrame, path: str | os.PathLike[str]) -> None:
    """Write a table as CSV: fixed float format, an empty cell where there is no value."""
    with atomic_path(path) as temporary:
        table.to_csv(temporary, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def read_table(
    path: str | os.PathLike[str], columns: Sequence[str] | None = None, result: bool = True
) -> pd.DataFrame:
    """Read a CSV table; StorageError if it is missing, damaged or lacks one of ``columns``.

    ``result`` says that a run can make the table anew, so that a damaged one is set aside.
    """
    if not Path(path).is_file():
        raise StorageError(f"{path}: no such file")
    try:
        content = Path(path).read_bytes()
        table = pd.read_csv(io.BytesIO(content))
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({reason(error)})") from error
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        fault = f"not a readable table ({' '.join(str(error).split())})"
        raise damaged(Path(path), fault, result) from error
    if not content.endswith(b"\n") or b"\0" in content:
        raise damaged(Path(path), "its end is missing or it is no text", result)
    missing = [name for name in columns or () if name not in table.columns]
    if missing:
        raise StorageError(f"{path}: lacks the column(s) {', '.join(missing)}")
    return table
