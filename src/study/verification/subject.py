"""Results that ``verify`` and ``bundle`` read, and the exit codes and output of both commands.

The results belong to one configuration, by default that of the last run.
"""

import argparse
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from pathlib import Path

from pdrom.core.yamlfile import read_yaml
from study.pipeline.commandline import CommandLine, check_files, recall
from study.pipeline.folders import DEFAULT, Folders, folders
from study.pipeline.plan import Plan, load_plan


@dataclass(frozen=True)
class Subject:
    """Results folder of one configuration, and the command that makes the results.

    options : command-line options that name the configuration
    """

    options: tuple[str, ...]
    folders: Folders

    @classmethod
    def of(cls, configfiles: Sequence[str], settings: Sequence[str]) -> "Subject":
        """Return the results of the configuration that files and ``settings`` (KEY=VALUE) define.

        If both are empty, it is the configuration of the last run.
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
        """Shell command that makes the files ``targets``, or without targets the whole study."""
        ends = ["--", *targets] if targets and self.options else targets
        return shlex.join(["./reproduce", *self.options, *ends])

    @cached_property
    def plan(self) -> Plan:
        """Plan of the study; configuration files and settings are merged as in Snakemake."""
        # Snakemake is imported only here, so that ``--help`` and argument errors come at once.
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
    """Return a parser of --configfile and --config, options of ``./reproduce`` with ``command``."""
    made = argparse.ArgumentParser(prog=f"./reproduce {command}", description=about, epilog=epilog)
    made.add_argument("--configfile", nargs="+", default=[], metavar="FILE")
    made.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE")
    return made


class Status(IntEnum):
    """Exit code of ``verify`` and ``bundle``; 1 is that of an error, 2 of an unknown option."""

    HOLDS = 0
    DIFFERS = 3
    MISSING = 4


def say(line: str) -> None:
    """Print ``line`` to standard output."""
    sys.stdout.write(f"{line}\n")
