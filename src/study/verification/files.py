"""``./reproduce verify --files``: check that every file is unchanged since the last run.

The plan of the study lists the files that must exist, the manifest has their checksums. Tables,
figures and the manuscript, unlike experiments, are also made again and compared, which reveals a
file that was replaced together with its checksum and its manifest entry.
"""

import filecmp
import os
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import PdromError, StorageError
from study.artifact.paths import MANIFEST
from study.artifact.reads import Every
from study.pipeline.manifest import Entry, read_manifest
from study.pipeline.plan import Job
from study.pipeline.unfit import Checked
from study.tables import declared
from study.verification.subject import Status, Subject, say

DAMAGED = "damaged (its checksum differs)"
NOT_THERE = "not there"
REPLACED = "not what its inputs give"
NOT_OURS = "no file of this study"
NOT_LISTED = "not in the manifest"
# Largest number of faults that are printed one by one.
FAULTS_SHOWN = 20
# Types of errors that a job may raise if somebody edited its input tables.
JOB_ERRORS = (PdromError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def verify_files(subject: Subject) -> Status:
    """Compare a study's files with its manifest; print faults, and commands to make files again.

    The next run makes a file again that differs, also if size and dates are those of the last run.
    """
    try:
        listed = read_manifest(subject.results).files
    except StorageError as error:
        say(f"{error}; a run that succeeds writes it: {subject.command()}")
        there = Path(MANIFEST.at(subject.results)).exists()
        return Status.DIFFERS if there else Status.MISSING
    entries = {os.path.normpath(Path(subject.results, name)): e for name, e in listed.items()}
    own = subject.plan.own_files
    paths = [*entries, *sorted(own - set(entries))]
    found = {path: _fault(path, entries.get(path), path in own) for path in paths}
    faults = {path: fault for path, fault in found.items() if fault}
    other: list[str] = []
    for job in chain.from_iterable(subject.plan.fixed.values()):
        if set(faults).isdisjoint((*job.files, *job.outputs.values())):
            other += differing(job)
    faults |= dict.fromkeys(other, REPLACED)
    checked = Checked(subject.results)
    checked.distrust(path for path, fault in faults.items() if fault in (DAMAGED, REPLACED))
    checked.save()
    for path, fault in list(faults.items())[:FAULTS_SHOWN]:
        say(f"{path}: {fault}" + ("" if fault == NOT_OURS else f"; run {subject.command()}"))
    if len(faults) > FAULTS_SHOWN:
        say(f"and {len(faults) - FAULTS_SHOWN} more; finish the study by {subject.command()}")
    count = len({*paths, *faults})
    say(f"{count - len(faults)} of {count} files are as the last run left them")
    if NOT_THERE in faults.values():
        return Status.MISSING
    return Status.DIFFERS if faults else Status.HOLDS


def _fault(path: str, entry: Entry | None, ours: bool) -> str:
    """Text on the fault of the file at ``path``; empty if it fits its ``entry``."""
    if not ours:
        return NOT_OURS
    if not Path(path).is_file():
        return NOT_THERE
    if entry is None:
        return NOT_LISTED
    return "" if entry.fits(Path(path)) else DAMAGED


def differing(job: Job) -> list[str]:
    """Repeat a job elsewhere; return the paths of outputs that change, or all if it fails."""
    old = list(job.outputs.values())
    # subfolders are kept: two outputs may have equal file names
    root = os.path.commonpath([os.path.dirname(path) or os.curdir for path in old])
    with TemporaryDirectory(prefix="pdrom-again-") as folder:
        new = [os.path.join(folder, os.path.relpath(path, root)) for path in old]
        try:
            job.make(dict(zip(job.outputs, new, strict=True)))
        except JOB_ERRORS:
            return old
        return [o for o, n in zip(old, new, strict=True) if not filecmp.cmp(o, n, shallow=False)]


def is_derived(name: str) -> bool:
    """Return whether the table ``name`` reads only other tables, no results of experiments."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every) for read in reads)
