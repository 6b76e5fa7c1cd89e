"""Dates of files that lie in the future, after the clock was set back.

Snakemake compares dates and refuses a result that is older than what it was made from, so that no
run would succeed until the clock has passed the dates.
"""

import os
import sys
import time
from collections.abc import Iterable
from pathlib import Path

STEP_NS = 10_000


def settle_dates(folders: Iterable[str | Path]) -> int:
    """Move files dated in the future to just before now, in their order; say and return how many.

    The order is kept: what was newer than something else, and makes it run again, still is.
    """
    now = time.time_ns()
    files = [path for folder in folders for path in Path(folder).rglob("*") if path.is_file()]
    future = {path: date for path in files if (date := path.stat().st_mtime_ns) > now}
    ranks = {date: rank for rank, date in enumerate(sorted(set(future.values()), reverse=True))}
    for path, date in future.items():
        settled = now - ranks[date] * STEP_NS
        os.utime(path, ns=(settled, settled))
    if future:
        sys.stderr.write(f"pdrom: {len(future)} files were dated in the future (clock set back?)\n")
    return len(future)
