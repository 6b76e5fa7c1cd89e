"""Resources of a job, measured in its own process: a line of its log, written and read here.

Snakemake's ``benchmark:`` samples every half minute, longer than most jobs run.
"""

import re
import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

MB = 1e6
_PEAK = 1.0 if sys.platform == "darwin" else 1024.0  # bytes of one unit of ru_maxrss
_WORDS = re.compile(
    r"used (?P<wall>[0-9.]+) s, (?P<processor>[0-9.]+) s of processor time, "
    r"(?P<memory>[0-9.]+) MB of memory$"
)


@dataclass(frozen=True)
class Usage:
    """Time and memory of a job.

    wall : seconds from its beginning to its end
    processor : seconds of user and system time, of the job and of what it started
    memory : largest resident memory, MB, of the job or of one process that it started; libraries
        that jobs share are counted for each of them
    """

    wall: float
    processor: float
    memory: float

    def __str__(self) -> str:
        return (
            f"used {self.wall:.3f} s, {self.processor:.3f} s of processor time, "
            f"{self.memory:.1f} MB of memory"
        )


def usage_since(start: float) -> Usage:
    """Usage from the monotonic clock's ``start`` on; all but ``wall`` is of the whole process.

    A job that is a fork begins with no processor time of its own.
    """
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return Usage(
        wall=time.monotonic() - start,
        processor=sum(one.ru_utime + one.ru_stime for one in used),
        memory=max(one.ru_maxrss for one in used) * _PEAK / MB,
    )


def usage_of(log: str | Path) -> Usage | None:
    """Resources of the job that wrote a log; None where it did not end well, or there is no log."""
    try:
        lines = Path(log).read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return None
    found = _WORDS.search(lines[-1]) if lines else None
    if found is None:
        return None
    return Usage(**{name: float(value) for name, value in found.groupdict().items()})
