"""``./reproduce verify --files``: check that every file is unchanged since the last run.

The plan of the study lists the files that must exist, the manifest has their checksums. Tables,
figures and the manuscript are also made again from the existing files and compared. This reveals a
file that was replaced together with its checksum and its manifest entry. Experiments take too long
to be repeated; of their results only the checksums are compared.
"""

import filecmp
import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import PdromError, StorageError
from study.artifact.paths import MANIFEST
from study.artifact.reads import Every
from study.pipeline.manifest import Entry, asked_for, read_manifest
from study.pipeline.plan import Job
from study.pipeline.unfit import Checked
from study.tables import declared
from study.verification.subject import Status, Subject, say

DAMAGED = "damaged (its checksum differs)"
LOST = "not there"
OTHER = "not what its inputs give"
FOREIGN = "no file of this study"
UNLISTED = "not in the manifest"
# Largest number of faults that are printed one by one.
SHOWN = 20
# Types of errors that a job may raise if somebody edited its input tables.
FAULTS = (PdromError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def verify_files(subject: Subject) -> Status:
    """Compare a study's files with its manifest; print faults, and commands to make files again.

    The next run makes a file again that differs, also if size and dates are those of the last run.
    """
    place = Path(MANIFEST.at(subject.results))
    hint = f"a run that succeeds writes it: {subject.command()}"
    if not place.is_file():
        say(f"{place}: not there; {hint}")
        return Status.MISSING
    try:
        listed = read_manifest(subject.results).files
    except StorageError as error:
        say(f"{error}; {hint}")
        return Status.DIFFERS
    entries = {os.path.normpath(Path(subject.results, name)): e for name, e in listed.items()}
    own = subject.plan.own_files
    ours = own | set(asked_for(entries, subject.plan))
    paths = [*entries, *sorted(own - set(entries))]
    found = {path: _fault(path, entries.get(path), path in ours) for path in paths}
    faults = {path: fault for path, fault in found.items() if fault}
    other: list[str] = []
    for job in chain.from_iterable(subject.plan.fixed.values()):
        if set(faults).isdisjoint((*job.files, *job.outputs.values())):
            other += differing(job)
    faults |= dict.fromkeys(other, OTHER)
    checked = Checked(subject.results)
    checked.distrust(path for path, fault in faults.items() if fault in (DAMAGED, OTHER))
    checked.save()
    for path, fault in list(faults.items())[:SHOWN]:
        command = subject.command(*{path} - own)  # a run makes files beside the study if asked for
        say(f"{path}: {fault}" + ("" if fault == FOREIGN else f"; run {command}"))
    if len(faults) > SHOWN:
        say(f"and {len(faults) - SHOWN} more; finish the study by {subject.command()}")
    count = len({*paths, *faults})
    say(f"{count - len(faults)} of {count} files are as the last run left them")
    if LOST in faults.values():
        return Status.MISSING
    return Status.DIFFERS if faults else Status.HOLDS


def _fault(path: str, entry: Entry | None, ours: bool) -> str:
    """Text on the fault of the file at ``path``; empty if the file agrees with the manifest.

    ``ours`` tells whether the file belongs to the study, ``entry`` is its line in the manifest.
    """
    if not ours:
        return FOREIGN
    if not Path(path).is_file():
        return LOST
    if entry is None:
        return UNLISTED
    return "" if entry.fits(Path(path)) else DAMAGED


@contextmanager
def made(job: Job) -> Iterator[dict[str, Path]]:
    """Run a job in a temporary folder; yield a mapping of its output paths to the new files.

    Raises StorageError if the job fails on the existing input files.
    """
    parents = [os.path.dirname(path) or os.curdir for path in job.outputs.values()]
    root = os.path.commonpath(parents)  # keep subfolders: two outputs may have equal file names
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
    """Repeat a job; return the paths of outputs that change, or all its outputs if it fails."""
    try:
        with made(job) as files:
            return [old for old, new in files.items() if not filecmp.cmp(old, new, shallow=False)]
    except StorageError:
        return list(job.outputs.values())


def is_derived(name: str) -> bool:
    """Return whether the table ``name`` reads only other tables, no results of experiments."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every) for read in reads)
