"""``./reproduce verify --files``: whether every file is the one that the last run left.

The plan says which files there must be, the manifest which bytes they have; what takes seconds is
made again from the others and compared (`study.verification.again`).
"""

import os
import shlex
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.store import Condition, check_file
from study.artifact.paths import MANIFEST
from study.pipeline.manifest import Entry, Manifest, asked_for, own_files, read_manifest
from study.pipeline.resolve import Job
from study.verification.again import differing
from study.verification.status import Status, say
from study.verification.subject import Subject

DAMAGED = "damaged (its checksum differs)"
LOST = "not there"
OTHER = "not what its inputs give"
FOREIGN = "no file of this study"
UNLISTED = "not in the manifest"
# Faults that have a line of their own.
SHOWN = 20


def verify_files(subject: Subject) -> Status:
    """Compare the files of ``subject`` with its manifest; say what makes a bad one again."""
    place = Path(MANIFEST.at(subject.results))
    if not place.is_file():
        say(f"{place}: not there; a run that succeeds writes it: {subject.command()}")
        return Status.MISSING
    try:
        manifest = read_manifest(subject.results)
    except StorageError as error:
        say(f"{error}; a run that succeeds writes it: {subject.command()}")
        return Status.DIFFERS
    return _compare(subject, manifest)


def _compare(subject: Subject, manifest: Manifest) -> Status:
    plan, folders = subject.plan, subject.folders
    entries = {_normal(subject.results, name): entry for name, entry in manifest.files.items()}
    own = own_files(plan)
    ours = own | set(asked_for(entries, plan, folders))
    faults = {path: _fault(path, entry, path in ours) for path, entry in entries.items()}
    faults |= {path: _unlisted(path) for path in sorted(own - set(entries))}
    faults = {path: fault for path, fault in faults.items() if fault}
    faults |= dict.fromkeys(_other(chain.from_iterable(plan.fixed.values()), set(faults)), OTHER)
    for path, fault in list(faults.items())[:SHOWN]:
        hint = "" if fault == FOREIGN else f"; make it again by {command_for(subject, path)}"
        say(f"{path}: {fault}{hint}")
    if len(faults) > SHOWN:
        say(f"and {len(faults) - SHOWN} more; finish the study by {subject.command()}")
    count = len(entries | faults)
    say(f"{count - len(faults)} of {count} files are as the last run left them")
    if LOST in faults.values():
        return Status.MISSING
    return Status.DIFFERS if faults else Status.HOLDS


def _normal(results: str, name: str) -> str:
    return os.path.normpath(Path(results, name))


def _fault(path: str, entry: Entry, ours: bool) -> str:
    """Fault of a file of the manifest; empty if there is none."""
    if not ours:
        return FOREIGN
    if not Path(path).is_file():
        return LOST
    intact = entry.fits(Path(path)) and check_file(path) is Condition.INTACT
    return "" if intact else DAMAGED


def _unlisted(path: str) -> str:
    return UNLISTED if Path(path).is_file() else LOST


def _other(made: Iterable[Job], faulty: set[str]) -> list[str]:
    """Files that are not what their inputs give, where the inputs are without fault."""
    return [
        path
        for job in made
        if faulty.isdisjoint((*job.files, *job.outputs.values()))
        for path in differing(job)
    ]


def command_for(subject: Subject, path: str) -> str:
    """Command that makes the file ``path`` of ``subject`` again, even if there is one."""
    return shlex.join(["./reproduce", *subject.options, "--force", "--", path])
