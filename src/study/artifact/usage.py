"""Time and memory of a job, measured in its own process, as a line of the job's log.

Snakemake's ``benchmark:`` samples only every 30 s, which is longer than most jobs take.
"""

import re
import resource
import sys
import time
from dataclasses import dataclass
from pathlib import Path

MB = 1e6
_PEAK = 1.0 if sys.platform == "darwin" else 1024.0  # bytes per unit of ru_maxrss
_WORDS = re.compile(
    r"used (?P<wall>[0-9.]+) s, (?P<processor>[0-9.]+) s of processor time, "
    r"(?P<memory>[0-9.]+) MB of memory$"
)


@dataclass(frozen=True)
class Usage:
    """Time and memory of a job.

    wall : seconds from its start to its end
    processor : user and system seconds of the job and of the processes that it started
    memory : largest resident memory, MB, of the job or of one process that it started; memory of
        libraries that jobs share is included for each job
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
    """Usage since ``start``, s of the monotonic clock; processor time and memory of the process.

    Processor time starts at zero in a forked job.
    """
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return Usage(
        wall=time.monotonic() - start,
        processor=sum(one.ru_utime + one.ru_stime for one in used),
        memory=max(one.ru_maxrss for one in used) * _PEAK / MB,
    )


def usage_of(log: str | Path) -> Usage | None:
    """Read the usage from the log of a job; None without a log or if the job failed."""
    try:
        lines = Path(log).read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return None
    found = _WORDS.search(lines[-1]) if lines else None
    if found is None:
        return None
    return Usage(**{name: float(value) for name, value in found.groupdict().items()})
