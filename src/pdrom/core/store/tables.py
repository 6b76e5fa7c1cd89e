"""Tables as CSV."""

import io
import os
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store.atomic import atomic_path
from pdrom.core.store.condition import require_intact
from pdrom.core.store.oserrors import reason

FLOAT_FORMAT = "%.10g"


def write_table(
    table: pd.DataFrame, path: str | os.PathLike[str], with_checksum: bool = True
) -> None:
    """Write a table as CSV to ``path``: fixed float format, an empty cell for no value."""
    with atomic_path(path, with_checksum) as temporary:
        table.to_csv(temporary, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")


def read_table(
    path: str | os.PathLike[str], columns: Sequence[str] | None = None, result: bool = True
) -> pd.DataFrame:
    """Read the CSV table ``path``; StorageError if missing, damaged or without one of ``columns``.

    ``result`` marks a table that a run wrote, with a checksum; other tables have none.
    """
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
