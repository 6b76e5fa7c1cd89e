"""Command line of ``./reproduce verify``."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pdrom.core.paths import TABLE
from pdrom.core.store import Condition, check_file
from pdrom.pipeline.tables import all_tables
from pdrom.verification.files import verify_files
from pdrom.verification.status import Status
from pdrom.verification.subject import Subject

CODES = "exit codes: 0 all holds; 1 faulty input; 2 not understood; 3 differs; 4 not there"


def parser() -> argparse.ArgumentParser:
    """Parser of the arguments after the word ``verify``."""
    made = argparse.ArgumentParser(
        prog="./reproduce verify",
        description="Whether the results of the last run are the expected ones.",
        epilog=CODES,
    )
    made.add_argument("--configfile", nargs="+", default=[], metavar="FILE")
    made.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE")
    made.add_argument("--files", action="store_true", help="compare every file with the manifest")
    return made


def verify(arguments: Sequence[str]) -> Status:
    """Do what the command line asks.

    Raises
    ------
    ConfigurationError
        The configuration is faulty.
    """
    asked = parser().parse_args(arguments)
    subject = Subject.of(asked.configfile, asked.config)
    return verify_files(subject) if asked.files else _complete(subject)


def _complete(subject: Subject) -> Status:
    """Whether every table is there, with its checksum."""
    absent = {
        name: path
        for name in all_tables()
        if not Path(path := TABLE.at(subject.results, name=name)).is_file()
        or check_file(path) is not Condition.INTACT
    }
    for name, path in absent.items():
        sys.stdout.write(f"{path}: not there or damaged; make it by {subject.command(name)}\n")
    return Status.MISSING if absent else Status.HOLDS
