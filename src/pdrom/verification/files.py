"""``./reproduce verify --files``: whether every file is the one that the last run left."""

import os
import shlex
import sys
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.paths import MANIFEST
from pdrom.pipeline.manifest import Manifest, read_manifest
from pdrom.verification.status import Status
from pdrom.verification.subject import Subject


def verify_files(subject: Subject) -> Status:
    """Compare the files of a study with its manifest; say what makes a bad one anew."""
    place = Path(MANIFEST.at(subject.results))
    if not place.is_file():
        _say(f"{place}: not there; a run that succeeds writes it: {subject.command()}")
        return Status.MISSING
    try:
        manifest = read_manifest(subject.results)
    except StorageError as error:
        _say(f"{error}; a run that succeeds writes it: {subject.command()}")
        return Status.DIFFERS
    return _compare(subject, manifest)


def _compare(subject: Subject, manifest: Manifest) -> Status:
    faults = {}
    for name, entry in manifest.files.items():
        path = Path(os.path.normpath(Path(subject.results, name)))
        if not path.is_file():
            faults[path] = Status.MISSING
        elif not entry.fits(path):
            faults[path] = Status.DIFFERS
    words = {Status.MISSING: "not there", Status.DIFFERS: "damaged (its checksum differs)"}
    for path, fault in faults.items():
        _say(f"{path}: {words[fault]}; make it anew by {anew(subject, path)}")
    count = len(manifest.files)
    _say(f"{count - len(faults)} of {count} files are as the last run left them")
    return min(faults.values(), default=Status.HOLDS)


def anew(subject: Subject, path: Path) -> str:
    """The command that makes one file anew, whatever is in its place."""
    return shlex.join(["./reproduce", *subject.options, "--force", "--", str(path)])


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
