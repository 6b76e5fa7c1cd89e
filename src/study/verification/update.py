"""New expected tables, from those of a finished run, with the reason."""

import subprocess
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.machine import machine
from pdrom.core.store import Condition, check_file, read_table
from study.artifact.paths import TABLE
from study.tables import declared
from study.verification.references import folder_of, note, write_reference
from study.verification.subject import Subject

NOTHING = "Nothing to be done"


def update(subject: Subject, reason: str) -> Path:
    """Write the expected tables of ``subject`` again, for a ``reason``; the folder that holds them.

    Raises
    ------
    ConfigurationError
        No reason is given.
    StorageError
        A table is missing, damaged, or older than what it is made from: nothing is written.
    """
    words = " ".join(reason.split())
    if not words:
        raise ConfigurationError('verify --update: say why, as in --reason "a new method"')
    paths = {name: TABLE.at(subject.results, name=name) for name in declared()}
    for name, path in paths.items():
        if not Path(path).is_file():
            raise StorageError(f"{path}: not there; make it by {subject.command(name)}")
        if check_file(path) is not Condition.INTACT:
            raise StorageError(f"{path}: damaged; delete it and run {subject.command(name)}")
    _require_new(subject)
    frames = {name: declared()[name].checked(read_table(path)) for name, path in paths.items()}
    return write(subject.results, frames, words)


def write(results: str, frames: Mapping[str, pd.DataFrame], reason: str) -> Path:
    """Write the expected form of ``frames`` of ``results`` and a line with the ``reason``."""
    folder = folder_of(results)
    for name, frame in frames.items():
        write_reference(declared()[name], frame, folder)
    for path in [*folder.glob("*.csv"), *folder.glob("*.csv.xz")]:
        if path.name.partition(".")[0] not in frames:
            path.unlink()  # a table that no longer exists
    here = machine()
    code = f"{here.pdrom} ({here.commit})"
    note(folder, reason, datetime.now(UTC).date(), code)
    return folder


def _require_new(subject: Subject) -> None:
    """StorageError if a run would make one of the tables again."""
    command = [sys.executable, "-m", "study.pipeline.front", "-n", *subject.options, "--"]
    done = subprocess.run([*command, *declared()], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no word"])[-1]
        raise StorageError(f"verify --update: the run cannot be planned: {last}")
    if NOTHING not in done.stdout + done.stderr:
        raise StorageError(
            f"verify --update: tables are older than what they are made from; run "
            f"{subject.command()} first"
        )
