"""Command ``./reproduce verify`` compares results with expected tables, or updates these tables."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.machine import machine
from pdrom.core.store import write_text
from study.article.build import INDEX, write_verified
from study.artifact.paths import ARTICLE, TABLE
from study.pipeline.commandline import one_line
from study.pipeline.tracked import outdated_rows
from study.pipeline.unfit import faults
from study.tables import declared
from study.verification.examine import GOOD, Examination, Line, Outcome
from study.verification.files import verify_files
from study.verification.references import LOG, folder_of, note, write_reference
from study.verification.subject import Status, Subject, options_parser, say

EXIT_CODES = "exit codes: 0 all holds; 1 faulty input; 2 not understood; 3 differs; 4 not there"
PAGE = "verification.md"
# Largest number of differences that the file `PAGE` lists for one table, figure or claim.
DIFFERENCES_SHOWN = 20


def update(subject: Subject, reason: str) -> Path:
    """Replace the expected tables by those of ``subject`` and log the reason; return their folder.

    Raises ConfigurationError without a reason, StorageError if a run would make a table again.
    """
    words = " ".join(reason.split())
    if not words:
        raise ConfigurationError('verify --update: say why, as in --reason "a new method"')
    examination = Examination(subject)
    tables = {name: examination.found(name) for name in declared()}
    targets = [TABLE.at(subject.results, name=name) for name in tables]
    for path, fault in faults(subject.plan, targets).items():
        raise StorageError(f"verify --update: {path}: {fault}; run {subject.command()} first")
    folder = folder_of(subject.results)
    for name, frame in tables.items():
        write_reference(declared()[name], frame, folder)
    for old in [*folder.glob("*.csv"), *folder.glob("*.csv.xz")]:
        if old.name.partition(".")[0] not in declared():
            old.unlink()  # delete the expected version of a table that no longer exists
    here = machine()
    note(folder, words, datetime.now(UTC).date(), f"{here.pdrom} ({here.commit})")
    return folder


def parser() -> argparse.ArgumentParser:
    made = options_parser(
        "verify", "Compare the last run's results with the expected ones.", EXIT_CODES
    )
    what = made.add_mutually_exclusive_group()
    what.add_argument("--files", action="store_true", help="check that no file has changed")
    what.add_argument("--update", action="store_true", help="expect the results of the last run")
    made.add_argument("--reason", default="", help="why --update")
    return made


def verify(arguments: Sequence[str]) -> Status:
    """Run ``./reproduce verify`` with these command-line ``arguments``; return its exit code."""
    asked = parser().parse_args(arguments)
    subject = Subject.of(asked.configfile, asked.config)
    if asked.files:
        return verify_files(subject)
    if asked.update:
        say(f"expected tables: {update(subject, asked.reason)}")
        return Status.HOLDS
    return verify_tables(subject)


def verify_tables(subject: Subject) -> Status:
    """Compare the tables of ``subject`` with the expected ones; print outcomes and write `PAGE`."""
    folder = folder_of(subject.results)
    if not folder.is_dir():
        hint = 'write them by ./reproduce verify --update --reason "..."'
        raise ConfigurationError(f"{folder}: no expected tables of this configuration; {hint}")
    lines = Examination(subject).lines()
    for line in lines:
        say(str(line))
    written = Path(subject.results) / PAGE
    about = f"Results in `{subject.results}`, expected ones in `{folder}` (`{LOG}` says why)."
    write_text(page(lines, about), written)
    pages = Path(ARTICLE.at(subject.results, name=INDEX))
    if pages.is_file():
        outcomes = (str(line).partition(": ") for line in lines)
        write_verified({name: outcome for name, _, outcome in outcomes}, pages.parent)
    if subject.plan.study.settings.recorded and (warning := outdated_rows()):
        say(warning)
    say(counted(lines))
    say(f"page: {written}")
    return status_of(lines)


def status_of(lines: Iterable[Line]) -> Status:
    """Return `MISSING` if a result is missing, `DIFFERS` if one differs or is new, else `HOLDS`."""
    worst = max((line.outcome for line in lines), key=[*Outcome].index)
    bad = Status.MISSING if worst is Outcome.MISSING else Status.DIFFERS
    return Status.HOLDS if worst in GOOD else bad


def counted(lines: Sequence[Line]) -> str:
    """Text that says, for claims, figures and tables, how many have each outcome."""
    parts = []
    for kind in dict.fromkeys(line.kind for line in lines):
        own = [line.outcome for line in lines if line.kind == kind]
        counts = ", ".join(f"{own.count(o)} {o}" for o in Outcome if o in own)
        parts.append(f"{kind}s: {counts}")
    return "; ".join(parts)


def page(lines: Sequence[Line], about: str) -> str:
    """Return a Markdown page: the sentence ``about``, and all ``lines`` with their differences."""
    parts = [f"# Verification\n\n{about}\nSee `docs/verification.md`.\n\n{counted(lines)}.\n"]
    for line in lines:
        more = len(line.details) - DIFFERENCES_SHOWN
        parts += [f"- {line}", *(f"  - {text}" for text in line.details[:DIFFERENCES_SHOWN])]
        parts += [f"  - and {more} more"] if more > 0 else []
    return "\n".join([*parts, ""])


if __name__ == "__main__":
    with one_line():
        sys.exit(verify(sys.argv[1:]))
