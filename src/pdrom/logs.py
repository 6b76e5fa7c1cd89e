"""One log per rule, and what the user sees when a job fails."""

import logging
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pdrom.errors import PdromError

FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


class _LogFile(logging.FileHandler):
    """A log whose disk is full is cut short; the job's own files say that there is no space."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Say nothing: the default prints a traceback for every message."""


@contextmanager
def job_log(path: str, level: int = logging.INFO) -> Iterator[logging.Logger]:
    """Send the package's log to ``path`` while a job runs.

    A `PdromError` (a user's mistake) ends the job with one line on stderr; any other exception
    keeps its traceback in the log and one line on stderr that says where to look.
    """
    logger = logging.getLogger("pdrom")
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        handler = _LogFile(path, mode="w", encoding="utf-8")
    except OSError as error:
        sys.exit(f"pdrom: {path}: cannot be written ({error.strerror})")
    handler.setFormatter(logging.Formatter(FORMAT))
    previous = logger.level
    logger.addHandler(handler)
    logger.setLevel(level)
    try:
        yield logger
    except PdromError as error:
        logger.error("%s: %s", type(error).__name__, error)
        sys.exit(f"pdrom: {error}")
    except Exception as error:
        logger.error("unexpected failure\n%s", traceback.format_exc())
        sys.exit(f"pdrom: {type(error).__name__}: {error} (traceback in {path})")
    finally:
        logger.removeHandler(handler)
        logger.setLevel(previous)
        with suppress(OSError):
            handler.close()
