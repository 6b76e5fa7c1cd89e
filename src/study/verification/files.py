"""``./reproduce verify --files``: check that every file is unchanged since the last run.

The plan lists the files that must exist, the manifest has their checksums. Results that are made in
seconds are made again from their inputs and compared (`study.verification.again`).
"""

import os
import shlex
from itertools import chain
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.store import Condition, check_file
from study.artifact.paths import MANIFEST
from study.pipeline.manifest import Entry, asked_for, own_files, read_manifest
from study.verification.again import differing
from study.verification.status import Status, say
from study.verification.subject import Subject

DAMAGED = "damaged (its checksum differs)"
LOST = "not there"
OTHER = "not what its inputs give"
FOREIGN = "no file of this study"
UNLISTED = "not in the manifest"
# Largest number of faults that are printed one by one.
SHOWN = 20


def verify_files(subject: Subject) -> Status:
    """Compare the files of ``subject`` with its manifest; print faults and remedies."""
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
    own = own_files(subject.plan)
    ours = own | set(asked_for(entries, subject.plan, subject.folders))
    paths = [*entries, *sorted(own - set(entries))]
    found = {path: _fault(path, entries.get(path), path in ours) for path in paths}
    faults = {path: fault for path, fault in found.items() if fault}
    other: list[str] = []
    for job in chain.from_iterable(subject.plan.fixed.values()):
        if set(faults).isdisjoint((*job.files, *job.outputs.values())):
            other += differing(job)
    faults |= dict.fromkeys(other, OTHER)
    for path, fault in list(faults.items())[:SHOWN]:
        command = shlex.join(["./reproduce", *subject.options, "--force", "--", path])
        say(f"{path}: {fault}" + ("" if fault == FOREIGN else f"; make it again by {command}"))
    if len(faults) > SHOWN:
        say(f"and {len(faults) - SHOWN} more; finish the study by {subject.command()}")
    count = len({*paths, *faults})
    say(f"{count - len(faults)} of {count} files are as the last run left them")
    if LOST in faults.values():
        return Status.MISSING
    return Status.DIFFERS if faults else Status.HOLDS


def _fault(path: str, entry: Entry | None, ours: bool) -> str:
    """Fault of the file at ``path`` in words; empty if the file agrees with its entry."""
    if not ours:
        return FOREIGN
    if not Path(path).is_file():
        return LOST
    if entry is None:
        return UNLISTED
    intact = entry.fits(Path(path)) and check_file(path) is Condition.INTACT
    return "" if intact else DAMAGED
