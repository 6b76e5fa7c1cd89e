"""One log per rule, and what the user sees when a job fails."""

import logging
import re
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from threadpoolctl import threadpool_limits

from pdrom.core.errors import PdromError

_JOB = re.compile(r"^Error in rule (?P<rule>\w+):(?P<body>(?:\n .*)*)", re.MULTILINE)
_REFUSED = re.compile(r"^WorkflowError in rule (?P<rule>\w+) .*\n(?P<text>.*)", re.MULTILINE)
_FIELD = re.compile(r"^ +(?P<key>log|output): (?P<path>[^\s,]+)", re.MULTILINE)
_ERROR = re.compile(r"^[-0-9]+ [0-9:,]+ ERROR +pdrom: (?P<text>.*)$", re.MULTILINE)
FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


class _LogFile(logging.FileHandler):
    """A log whose disk is full is cut short; the job's own files say that there is no space."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Say nothing: the default prints a traceback for every message."""


@contextmanager
def job_log(path: str, level: int = logging.INFO) -> Iterator[logging.Logger]:
    """Send the package's log to ``path`` while a job runs, and keep libraries to one thread.

    Snakemake gives the libraries of a job as many threads as the job claims, and one that measures
    claims all cores to be alone. More threads would also change the order of sums.

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
        with threadpool_limits(limits=1):
            yield logger
    except PdromError as error:
        logger.error("%s", error)
        sys.exit(f"pdrom: {error}")
    except Exception as error:
        fault = f"{type(error).__name__}: {error}"
        logger.error("%s (traceback in %s)\n%s", fault, path, traceback.format_exc())
        sys.exit(f"pdrom: {fault} (traceback in {path})")
    finally:
        logger.removeHandler(handler)
        logger.setLevel(previous)
        with suppress(OSError):
            handler.close()


def end_with_failures(workflow_logs: Sequence[str]) -> None:
    """End a failed run with what went wrong: the last lines that the user reads.

    Snakemake prints its own account after a job's message. Every failed job is named once more with
    the error in its log, and the process ends as a failure.

    Parameters
    ----------
    workflow_logs : Snakemake's logs of the run
    """
    text = "\n".join(_content(path) for path in workflow_logs)
    lines = [_failure(found["rule"], found["body"]) for found in _JOB.finditer(text)]
    lines += [f"pdrom: job {found['rule']}: {found['text']}" for found in _REFUSED.finditer(text)]
    advice = "pdrom: what is finished is kept; the same command goes on from there"
    sys.exit("\n".join([*dict.fromkeys(lines), advice]))


def _failure(rule: str, body: str) -> str:
    fields = {found["key"]: found["path"] for found in _FIELD.finditer(body)}
    errors = _ERROR.findall(_content(fields.get("log", "")))
    if errors:
        return f"pdrom: job {rule} failed: {errors[-1]}"
    made = fields.get("output", "its result")
    return f"pdrom: job {rule} ended without a word while making {made}: killed? out of memory?"


def _content(path: str) -> str:
    """Text of a log; nothing if it could not be written."""
    return Path(path).read_text(encoding="utf-8", errors="replace") if Path(path).is_file() else ""
