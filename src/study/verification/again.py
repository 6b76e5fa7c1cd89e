"""Results made again from the files at hand: tables, figures, inputs of the manuscript, manuscript.

A file that was replaced together with its checksum and its entry in the manifest is not what its
inputs give. The results of experiments take too long for that: of them only checksums are compared.
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

# Errors that a job may raise when its tables were edited.
FAULTS = (PdromError, ArithmeticError, LookupError, TypeError, ValueError)


@contextmanager
def made(job: Job) -> Iterator[dict[str, Path]]:
    """Files that a job makes now, by the path that each has in the study.

    Raises
    ------
    StorageError
        It cannot be made from the files at hand.
    """
    parents = [os.path.dirname(path) or os.curdir for path in job.outputs.values()]
    root = os.path.commonpath(parents)  # two pages may have one name in different folders
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
    """Outputs of a job that are not what its inputs give; all of them if these give none."""
    try:
        with made(job) as files:
            return [old for old, new in files.items() if not filecmp.cmp(old, new, shallow=False)]
    except StorageError:
        return list(job.outputs.values())


def is_derived(name: str) -> bool:
    """Whether the table ``name`` is made from other tables alone."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every) for read in reads)
