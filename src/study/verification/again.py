"""Derived results made again from the existing files: tables, figures, manuscript and its inputs.

A file that was replaced together with its checksum and its manifest entry differs from the file
made again. Results of experiments take too long to repeat; only their checksums are compared.
"""

import filecmp
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import PdromError, StorageError
from study.artifact.reads import Every
from study.pipeline.resolve import Job
from study.tables import declared

# Errors that a job may raise if its input tables were edited.
FAULTS = (PdromError, ArithmeticError, LookupError, TypeError, ValueError)


@contextmanager
def made(job: Job) -> Iterator[dict[str, Path]]:
    """Run a job into a temporary folder; yield the new files by the paths of the study's files.

    Raises
    ------
    StorageError
        The job fails on the existing input files.
    """
    parents = [os.path.dirname(path) or os.curdir for path in job.outputs.values()]
    root = os.path.commonpath(parents)  # two pages may have the same name in different folders
    with TemporaryDirectory(prefix="pdrom-again-") as folder:
        inside = {name: os.path.relpath(path, root) for name, path in job.outputs.items()}
        outputs = {name: os.path.join(folder, path) for name, path in inside.items()}
        try:
            job.make(outputs)
        except FAULTS as error:
            fault = " ".join(str(error).split())
            first = next(iter(job.outputs.values()))
            raise StorageError(f"{first}: cannot be made again ({fault})") from error
        yield {path: Path(outputs[name]) for name, path in job.outputs.items()}


def differing(job: Job) -> list[str]:
    """Paths of a job's outputs that differ from outputs made again; all if the job fails."""
    try:
        with made(job) as files:
            return [old for old, new in files.items() if not filecmp.cmp(old, new, shallow=False)]
    except StorageError:
        return list(job.outputs.values())


def is_derived(name: str) -> bool:
    """Return whether the table ``name`` reads other tables only, no files of experiments."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every) for read in reads)
