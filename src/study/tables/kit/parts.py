"""Tables whose rows experiments have written, file by file."""

from collections.abc import Iterable

import pandas as pd

from pdrom.core.store import read_table
from study.artifact.paths import File


def joined(files: Iterable[File]) -> pd.DataFrame:
    """Rows of all files, in order; without columns if there are no rows."""
    parts = [part for part in (read_table(file.path) for file in files) if len(part)]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
