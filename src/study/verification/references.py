"""Files of the expected tables, kept in git below ``results/reference``.

Columns that are never compared are left out, and numbers are rounded to `DIGITS` digits. A table is
a CSV file, whose changes git shows; a large table is compressed (``.csv.xz``) to save space.
"""

import lzma
from datetime import date
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import atomic_path, write_text
from study.artifact.paths import RESULTS
from study.tables import declared
from study.tables.kit.declaration import Table
from study.verification.compare import kept

# Stored digits of numbers; the error of rounding is at most a hundredth of any tolerance.
DIGITS = 9
SUFFIXES, PACKED_BYTES = (".csv", ".csv.xz"), 50_000  # larger files (in bytes) are compressed
LOG = "changes.md"
LOG_HEADER = """# Changes of the expected tables

Written by `./reproduce verify --update --reason "..."`, newest last.

"""


class Reference(NamedTuple):
    """Expected table: ``frame`` has all declared columns, the table's file has only ``columns``."""

    frame: pd.DataFrame
    columns: tuple[str, ...]


def folder_of(results: str) -> Path:
    """Folder of the expected tables with which those in the folder ``results`` are compared."""
    root = Path(RESULTS)
    return root / "reference" / Path(results).relative_to(root) / "tables"


def write_reference(table: Table, frame: pd.DataFrame, folder: Path) -> None:
    """Write ``frame``, the content of ``table``, as the expected table into ``folder``."""
    stored, form = frame[[c.name for c in kept(table)]], f"%.{DIGITS}g"
    content = stored.to_csv(index=False, float_format=form, lineterminator="\n").encode()
    path, other = (folder / f"{table.name}{suffix}" for suffix in SUFFIXES)
    if len(content) > PACKED_BYTES:
        path, other, content = other, path, lzma.compress(content, preset=9)
    with atomic_path(path, with_checksum=False) as temporary:
        temporary.write_bytes(content)
    other.unlink(missing_ok=True)


def read_references(folder: Path) -> dict[str, Reference]:
    """Return name -> expected table in ``folder``; StorageError if one cannot be read."""
    found = {}
    for name, table in declared().items():
        for path in (p for suffix in SUFFIXES if (p := folder / f"{name}{suffix}").is_file()):
            try:
                frame = pd.read_csv(path)
            except (OSError, EOFError, lzma.LZMAError, ValueError) as error:
                reason = " ".join(str(error).split())
                raise StorageError(f"{path}: cannot be read ({reason})") from error
            whole = table.checked(frame.reindex(columns=list(table.column_names)))
            found[name] = Reference(whole, tuple(frame.columns))
    return found


def note(folder: Path, reason: str, day: date, code: str) -> None:
    """Add ``day``, version of the code and reason of an update to the log in ``folder``."""
    path = folder / LOG
    text = path.read_text(encoding="utf-8") if path.is_file() else LOG_HEADER
    line = f"- {day:%Y-%m-%d}, code {code}: {reason}\n"
    write_text(text + line, path, with_checksum=False)
