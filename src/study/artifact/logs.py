"""Write the log of a job, with its time and memory, and the message that users see if it fails.

Snakemake's ``benchmark:`` measures only every 30 s, which is longer than most jobs take.
"""

import faulthandler
import logging
import re
import resource
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, TextIO, cast

from threadpoolctl import threadpool_limits

from pdrom.core.errors import PdromError
from pdrom.core.store.checksum import damaged_set_aside

PACKAGES = ("pdrom", "study")
MB = 1e6
_PEAK = 1.0 if sys.platform == "darwin" else 1024.0  # bytes per unit of getrusage's ru_maxrss
_WORDS = re.compile(r"used ([0-9.]+) s, ([0-9.]+) s of processor time, ([0-9.]+) MB of memory\n*\Z")
FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


@contextmanager
def job_log(path: str) -> Iterator[logging.Logger]:
    """Write log messages to ``path`` while a job runs; limit libraries to one thread meanwhile.

    More threads would change the order of sums. A `PdromError` ends the job with one line on
    stderr; for any other exception, the log also gets the traceback. The log ends with time and
    memory if the job succeeds, or with Python's stack trace if a signal ends the job.
    Damaged results that the job reads are renamed, so that the next run makes them again.
    """
    start = time.monotonic()
    loggers = [logging.getLogger(name) for name in PACKAGES]
    logger = loggers[0]
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    handler = logging.FileHandler(path, mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter(FORMAT))
    previous = [each.level for each in loggers]
    for each in loggers:
        each.addHandler(handler)
        each.setLevel(logging.INFO)
    faulthandler.enable(cast(TextIO, handler.stream))
    try:
        with threadpool_limits(limits=1), damaged_set_aside():
            yield logger
        logger.info("%s", usage_since(start))
    except PdromError as error:
        logger.error("%s", error)
        sys.exit(f"pdrom: {error}")
    except Exception as error:
        fault = f"{type(error).__name__}: {error}"
        logger.error("%s (traceback in %s)\n%s", fault, path, traceback.format_exc())
        sys.exit(f"pdrom: {fault} (traceback in {path})")
    finally:
        faulthandler.disable()
        for each, level in zip(loggers, previous, strict=True):
            each.removeHandler(handler)
            each.setLevel(level)
        with suppress(OSError):
            handler.close()


@contextmanager
def warnings_to(stream: TextIO | None, form: str = "pdrom: warning: %(message)s") -> Iterator[None]:
    """Write warnings of pdrom and study in ``form`` to ``stream``; None suppresses them."""
    handler = logging.NullHandler() if stream is None else logging.StreamHandler(stream)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter(form))
    for name in PACKAGES:
        logging.getLogger(name).addHandler(handler)
    try:
        yield
    finally:
        for name in PACKAGES:
            logging.getLogger(name).removeHandler(handler)


class Usage(NamedTuple):
    """Seconds that a job took, its processor seconds (with child processes), and memory in MB.

    The memory is the peak of the job or of a child process, with libraries, which jobs share.
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
    """Return the time since ``start`` (s, monotonic clock), and this process's time and memory."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return Usage(
        wall=time.monotonic() - start,
        processor=sum(one.ru_utime + one.ru_stime for one in used),
        memory=max(one.ru_maxrss for one in used) * _PEAK / MB,
    )


def usage_of(log: str | Path) -> Usage | None:
    """Read time and memory of a job from its log; None without a log or if the job failed."""
    with suppress(FileNotFoundError):
        if found := _WORDS.search(Path(log).read_text(encoding="utf-8", errors="replace")):
            return Usage(*map(float, found.groups()))
    return None
