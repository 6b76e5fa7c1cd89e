"""Command ``./reproduce verify``: arguments, comparison, update of the expected tables."""

import argparse
import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.machine import machine
from pdrom.core.store import Condition, check_file, read_table, write_text
from study.article.build import INDEX, write_verified
from study.artifact.paths import ARTICLE, TABLE
from study.tables import declared
from study.verification.examine import Examination
from study.verification.files import verify_files
from study.verification.lines import counted, page, status_of
from study.verification.references import LOG, folder_of, note, write_reference
from study.verification.subject import Status, Subject, ended, say

NOTHING = "Nothing to be done"


def update(subject: Subject, reason: str) -> Path:
    """Replace the expected tables of ``subject``, for a ``reason``; return the folder with them.

    Raises
    ------
    ConfigurationError
        The reason is empty.
    StorageError
        A table is missing, damaged, or older than its inputs: nothing is written.
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
    tables = [(table, table.checked(read_table(paths[name]))) for name, table in declared().items()]
    folder = folder_of(subject.results)
    for table, frame in tables:
        write_reference(table, frame, folder)
    for old in [*folder.glob("*.csv"), *folder.glob("*.csv.xz")]:
        if old.name.partition(".")[0] not in declared():
            old.unlink()  # reference of a table that no longer exists
    here = machine()
    note(folder, words, datetime.now(UTC).date(), f"{here.pdrom} ({here.commit})")
    return folder


CODES = "exit codes: 0 all holds; 1 faulty input; 2 not understood; 3 differs; 4 not there"
PAGE = "verification.md"


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments after the word ``verify``."""
    made = argparse.ArgumentParser(
        prog="./reproduce verify",
        description="Whether the results of the last run are the expected ones.",
        epilog=CODES,
    )
    made.add_argument("--configfile", nargs="+", default=[], metavar="FILE")
    made.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE")
    what = made.add_mutually_exclusive_group()
    what.add_argument(
        "--files",
        action="store_true",
        help="compare every file with the manifest, and with what it is made from",
    )
    what.add_argument("--update", action="store_true", help="these results are the expected ones")
    made.add_argument("--reason", default="", help="why --update")
    return made


def verify(arguments: Sequence[str]) -> Status:
    """Run the command with the ``arguments`` of the command line; return its exit code.

    Raises
    ------
    ConfigurationError
        The configuration is faulty, or it has no expected tables.
    StorageError
        A file cannot be read or written; --update is refused.
    """
    asked = parser().parse_args(arguments)
    subject = Subject.of(asked.configfile, asked.config)
    if asked.files:
        return verify_files(subject)
    if asked.update:
        say(f"expected tables: {update(subject, asked.reason)}")
        return Status.HOLDS
    return verify_tables(subject)


def verify_tables(subject: Subject) -> Status:
    """Compare the tables of ``subject`` with the expected tables; print and write the outcomes.

    Raises
    ------
    ConfigurationError
        The configuration has no expected tables.
    """
    folder = folder_of(subject.results)
    if not folder.is_dir():
        hint = 'write them by ./reproduce verify --update --reason "..."'
        raise ConfigurationError(f"{folder}: no expected tables of this configuration; {hint}")
    lines = Examination(subject).lines()
    for line in lines:
        say(str(line))
    written = Path(subject.results) / PAGE
    about = (
        f"Results in `{subject.results}`, expected ones in `{folder}` (`{LOG}` says why).",
        "What is compared, and what the outcomes mean, is in `docs/verification.md`.",
    )
    write_text(page(lines, about), written)
    pages = Path(ARTICLE.at(subject.results, name=INDEX))
    if pages.is_file():
        outcomes = (str(line).partition(": ") for line in lines)
        write_verified({name: outcome for name, _, outcome in outcomes}, pages.parent)
    say(counted(lines))
    say(f"page: {written}")
    return status_of(lines)


if __name__ == "__main__":
    sys.exit(ended(lambda: verify(sys.argv[1:])))
