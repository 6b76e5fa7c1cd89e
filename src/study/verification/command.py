"""Compare results with expected tables, or update these tables (``./reproduce verify``); write one
archive of the sources and the results (``./reproduce bundle``)."""

import argparse
import gzip
import io
import os
import subprocess
import sys
import tarfile
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from pdrom import __version__
from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.machine import machine
from pdrom.core.store import atomic_path, write_text
from study.article.build import INDEX, write_verified
from study.artifact.paths import ARTICLE, MANIFEST, TABLE
from study.pipeline.commandline import one_line
from study.pipeline.manifest import read_manifest
from study.pipeline.tracked import outdated_rows
from study.pipeline.unfit import faults
from study.tables import declared
from study.verification.compare import LOG, folder_of, note, write_reference
from study.verification.examine import GOOD, Examination, Line, Outcome
from study.verification.subject import Status, Subject, options_parser, say, verify_files

EXIT_CODES = "exit codes: 0 as expected, 1 faulty input, 2 unknown option, 3 different, 4 missing"
PAGE = "verification.md"
# Largest number of differences that the file `PAGE` lists for one table, figure or claim.
DIFFERENCES_SHOWN = 20


def update(subject: Subject, reason: str) -> Path:
    """Replace the expected tables by those of ``subject`` and log the reason; return their folder.

    Raises ConfigurationError if the reason is empty, StorageError if a table is not up to date.
    """
    words = " ".join(reason.split())
    if not words:
        raise ConfigurationError('verify --update: add a reason, as in --reason "a new method"')
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
            old.unlink()  # the study no longer has this table
    here = machine()
    note(folder, words, datetime.now(UTC).date(), f"{here.pdrom} ({here.commit})")
    return folder


def parser() -> argparse.ArgumentParser:
    made = options_parser(
        "verify", "Compare the results of the last run with the expected results.", EXIT_CODES
    )
    what = made.add_mutually_exclusive_group()
    what.add_argument("--files", action="store_true", help="check that files are unchanged")
    what.add_argument("--update", action="store_true", help="make these the expected results")
    made.add_argument("--reason", default="", help=f"reason for --update, written to {LOG}")
    return made


def verify(arguments: Sequence[str]) -> Status:
    """Run ``./reproduce verify`` with these command-line ``arguments``; return its exit code."""
    asked = parser().parse_args(arguments)
    subject = Subject.of(asked.configfile, asked.config)
    if asked.files:
        return verify_files(subject)
    if asked.update:
        say(f"updated the expected tables in {update(subject, asked.reason)}")
        return Status.HOLDS
    return verify_tables(subject)


def verify_tables(subject: Subject) -> Status:
    """Compare the tables of ``subject`` with the expected ones; print outcomes and write `PAGE`."""
    folder = folder_of(subject.results)
    if not folder.is_dir():
        hint = 'to accept its results, run ./reproduce verify --update --reason "..."'
        raise ConfigurationError(f"{folder}: no expected tables of this configuration; {hint}")
    lines = Examination(subject).lines()
    for line in lines:
        say(str(line))
    written = Path(subject.results) / PAGE
    about = f"Results: `{subject.results}`; expected tables: `{folder}` (history: `{LOG}`)."
    write_text(page(lines, about), written)
    pages = Path(ARTICLE.at(subject.results, name=INDEX))
    if pages.is_file():
        outcomes = (str(line).partition(": ") for line in lines)
        write_verified({name: outcome for name, _, outcome in outcomes}, pages.parent)
    if subject.plan.study.settings.recorded and (warning := outdated_rows()):
        say(warning)
    say(counted(lines))
    say(f"differences: {written}")
    return status_of(lines)


def status_of(lines: Iterable[Line]) -> Status:
    """Return `MISSING` if a result is missing, `DIFFERS` if one differs or is new, else `HOLDS`."""
    worst = max((line.outcome for line in lines), key=[*Outcome].index)
    bad = Status.MISSING if worst is Outcome.MISSING else Status.DIFFERS
    return Status.HOLDS if worst in GOOD else bad


def counted(lines: Sequence[Line]) -> str:
    """Count claims, figures and tables by outcome, as text."""
    parts = []
    for kind in dict.fromkeys(line.kind for line in lines):
        own = [line.outcome for line in lines if line.kind == kind]
        counts = ", ".join(f"{own.count(o)} {o}" for o in Outcome if o in own)
        parts.append(f"{kind}s: {counts}")
    return "; ".join(parts)


def page(lines: Sequence[Line], about: str) -> str:
    """Return a Markdown page of the text ``about`` and all ``lines`` with their differences."""
    parts = [f"# Verification\n\n{about}\nSee `docs/verification.md`.\n\n{counted(lines)}.\n"]
    for line in lines:
        more = len(line.details) - DIFFERENCES_SHOWN
        parts += [f"- {line}", *(f"  - {text}" for text in line.details[:DIFFERENCES_SHOWN])]
        parts += [f"  - and {more} more"] if more > 0 else []
    return "\n".join([*parts, ""])


ARCHIVE = f"pdrom-{__version__}"
BUNDLE = """Write one archive of the last commit and, in the folder published, of the results. Equal
commits and results give equal archives, byte for byte."""


def bundle(arguments: Sequence[str]) -> Status:
    """Write the archive if all files of the study are intact; otherwise print the faults."""
    chosen = options_parser("bundle", BUNDLE).parse_args(arguments)
    subject = Subject.of(chosen.configfile, chosen.config)
    status = verify_files(subject)
    if status is not Status.HOLDS:
        return status
    folder = Path(subject.results)
    names = [*read_manifest(subject.results).files, MANIFEST.pattern]
    small = {n: folder / n for n in names if not n.endswith(".h5")}  # a run makes HDF5 files again
    results = {os.path.normpath(f"published/results/{name}"): p for name, p in small.items()}
    target = folder / f"{ARCHIVE}.tar.gz"
    write_archive(Path(), results, target)
    say(f"{target}: {target.stat().st_size / 1e6:.1f} MB")
    return Status.HOLDS


def write_archive(root: Path, results: Mapping[str, Path], target: Path) -> None:
    """Write a gzipped tar archive of the last commit of ``root`` and of ``results`` to ``target``.

    ``results`` maps names in the archive to paths of files.
    """
    date = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    if changed := _git(root, "status", "--porcelain", "--untracked-files=no").decode():
        names = ", ".join(line[3:] for line in changed.splitlines())
        raise ConfigurationError(f"bundle: uncommitted changes in {names}; commit them first")
    made = io.BytesIO(_git(root, "archive", f"--prefix={ARCHIVE}/", "HEAD"))
    with tarfile.open(fileobj=made, mode="a") as archive:
        for name, path in sorted(results.items()):
            entry = tarfile.TarInfo(f"{ARCHIVE}/{name}")
            entry.size, entry.mtime = path.stat().st_size, date
            with open(path, "rb") as content:
                archive.addfile(entry, content)
    with atomic_path(target) as temporary:
        temporary.write_bytes(gzip.compress(made.getvalue(), mtime=date))


def _git(root: Path, *words: str) -> bytes:
    try:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        fault = "bundle: git cannot list the sources; install git and run this in a clone"
        raise ConfigurationError(fault) from error


if __name__ == "__main__":
    with one_line():
        sys.exit({"verify": verify, "bundle": bundle}[sys.argv[1]](sys.argv[2:]))
