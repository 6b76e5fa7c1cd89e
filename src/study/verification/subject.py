"""Find the results that ``verify`` and ``bundle`` read; define their exit codes and output.

The results belong to one configuration, by default that of the last run.

``./reproduce verify --files`` checks that every file is unchanged since the last run. The plan of
the study lists the files that must exist, the manifest has their checksums. Tables, figures and the
manuscript, but not experiments, are also made again and compared. This finds files that were
replaced together with their checksums and manifest entries.
"""

import argparse
import filecmp
import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import PdromError, StorageError
from pdrom.core.yamlfile import read_yaml
from study.artifact.paths import MANIFEST
from study.artifact.reads import Every
from study.pipeline.commandline import CommandLine, check_files, recall
from study.pipeline.folders import DEFAULT, Folders, folders
from study.pipeline.manifest import Entry, read_manifest
from study.pipeline.plan import Job, Plan, load_plan
from study.pipeline.unfit import Checked
from study.tables import declared


@dataclass(frozen=True)
class Subject:
    """Results folder of one configuration, and the command that makes the results.

    options : command-line options that select the configuration
    """

    options: tuple[str, ...]
    folders: Folders

    @classmethod
    def of(cls, configfiles: Sequence[str], settings: Sequence[str]) -> "Subject":
        """Return the results of the configuration that files and ``settings`` (KEY=VALUE) define.

        If both are empty, use the configuration of the last run.
        """
        files = ["--configfile", *configfiles] if configfiles else []
        command = CommandLine([*files, *(["--config", *settings] if settings else [])] or recall())
        check_files([DEFAULT, *command.configfiles])
        return cls(tuple(command.configuration), folders(command.configfiles, command.settings))

    @property
    def results(self) -> str:
        """Path of the results folder."""
        return self.folders.results

    def command(self, *targets: str) -> str:
        """Return the shell command that makes ``targets``; without targets, the whole study."""
        ends = ["--", *targets] if targets and self.options else targets
        return shlex.join(["./reproduce", *self.options, *ends])

    @cached_property
    def plan(self) -> Plan:
        """Plan of the study; configuration files and settings are merged as in Snakemake."""
        # Snakemake is imported only here, so that ``--help`` and argument errors appear at once.
        from snakemake.cli import parse_config
        from snakemake.settings.types import ConfigSettings
        from snakemake.utils import update_config

        command = CommandLine(self.options)
        files = list(map(Path, command.configfiles))
        given = ConfigSettings(config=parse_config(command.settings), configfiles=files)
        whole = dict(read_yaml(Path(DEFAULT)))
        update_config(whole, given.overwrite_config)
        return load_plan(whole, files, self.folders, quiet=True)


def options_parser(command: str, about: str, epilog: str | None = None) -> argparse.ArgumentParser:
    """Return a parser for ``./reproduce command`` with the options --configfile and --config."""
    last = "configuration of the results (default: of the last run)"
    made = argparse.ArgumentParser(prog=f"./reproduce {command}", description=about, epilog=epilog)
    made.add_argument("--configfile", nargs="+", default=[], metavar="FILE", help=last)
    made.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE", help="more settings")
    return made


class Status(IntEnum):
    """Exit code of ``verify`` and ``bundle``; an error gives 1, an unknown option 2."""

    HOLDS = 0
    DIFFERS = 3
    MISSING = 4


def say(line: str) -> None:
    """Print ``line`` to standard output."""
    sys.stdout.write(f"{line}\n")


DAMAGED = "damaged (its checksum differs)"
NOT_THERE = "not there"
REPLACED = "not made from its inputs"
NOT_OURS = "not a file of this study"
NOT_LISTED = "not in the manifest"
# Largest number of faults that are printed one by one.
FAULTS_SHOWN = 20
# Types of errors that a job may raise if somebody edited its input tables.
JOB_ERRORS = (PdromError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def verify_files(subject: Subject) -> Status:
    """Compare a study's files with its manifest; print faults, and commands to make files again.

    The next run makes different files again, even if their size and dates are unchanged.
    """
    try:
        listed = read_manifest(subject.results).files
    except StorageError as error:
        say(f"{error}; every successful run writes it, run {subject.command()}")
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
        say(f"and {len(faults) - FAULTS_SHOWN} more; run {subject.command()}")
    count = len({*paths, *faults})
    say(f"{count - len(faults)} of {count} files are unchanged since the last run")
    if NOT_THERE in faults.values():
        return Status.MISSING
    return Status.DIFFERS if faults else Status.HOLDS


def _fault(path: str, entry: Entry | None, ours: bool) -> str:
    if not ours:
        return NOT_OURS
    if not Path(path).is_file():
        return NOT_THERE
    if entry is None:
        return NOT_LISTED
    return "" if entry.fits(Path(path)) else DAMAGED


def differing(job: Job) -> list[str]:
    """Repeat a job in another folder; return the outputs that differ, or all if the job fails."""
    old = list(job.outputs.values())
    # keep subfolders, because two outputs may have equal file names
    root = os.path.commonpath([os.path.dirname(path) or os.curdir for path in old])
    with TemporaryDirectory(prefix="pdrom-again-") as folder:
        new = [os.path.join(folder, os.path.relpath(path, root)) for path in old]
        try:
            job.make(dict(zip(job.outputs, new, strict=True)))
        except JOB_ERRORS:
            return old
        return [o for o, n in zip(old, new, strict=True) if not filecmp.cmp(o, n, shallow=False)]


def is_derived(name: str) -> bool:
    """Return whether the table ``name`` reads only other tables and no results of experiments."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every) for read in reads)
