"""Command line of ``./reproduce verify``."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from pdrom.core.errors import ConfigurationError
from pdrom.core.store import write_text
from study.article.verified import INDEX, write_verified
from study.artifact.paths import ARTICLE
from study.verification.examine import Examination
from study.verification.files import verify_files
from study.verification.lines import Line, counted, page, status_of
from study.verification.references import LOG, folder_of
from study.verification.status import Status, say
from study.verification.subject import Subject
from study.verification.update import update

CODES = "exit codes: 0 all holds; 1 faulty input; 2 not understood; 3 differs; 4 not there"
PAGE = "verification.md"


def parser() -> argparse.ArgumentParser:
    """Parser of the arguments after the word ``verify``."""
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
    """Do what the ``arguments`` of the command line ask.

    Raises
    ------
    ConfigurationError
        The configuration is faulty, or nothing is expected of it.
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
    """Compare the tables of ``subject`` with the expected ones, write the page of it.

    Raises
    ------
    ConfigurationError
        Nothing is expected of the configuration.
    """
    folder = folder_of(subject.results)
    if not folder.is_dir():
        hint = 'write them by ./reproduce verify --update --reason "..."'
        raise ConfigurationError(f"{folder}: no expected tables of this configuration; {hint}")
    lines = Examination(subject).lines()
    for line in lines:
        say(str(line))
    written = Path(subject.results) / PAGE
    write_text(page(lines, _about(subject, folder)), written)
    pages = Path(ARTICLE.at(subject.results, name=INDEX))
    if pages.is_file():
        write_verified({f"{line.kind} {line.name}": _short(line) for line in lines}, pages.parent)
    say(counted(lines))
    say(f"page: {written}")
    return status_of(lines)


def _short(line: Line) -> str:
    return f"{line.outcome}, {line.text}" if line.text else str(line.outcome)


def _about(subject: Subject, folder: Path) -> list[str]:
    return [
        f"Results in `{subject.results}`, expected ones in `{folder}` (`{LOG}` says why).",
        "What is compared, and what the outcomes mean, is in `docs/verification.md`.",
    ]
