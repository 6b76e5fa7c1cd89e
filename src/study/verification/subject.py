"""Subject of a verification: the results of one configuration, by default of the last run."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from study.pipeline.commandline import CommandLine, check_files, merged, recall
from study.pipeline.folders import DEFAULT, Folders, folders
from study.pipeline.plan import Plan, load_plan


@dataclass(frozen=True)
class Subject:
    """Results of a configuration, and the commands that make them.

    options : command-line options that name the configuration
    """

    options: tuple[str, ...]
    folders: Folders

    @classmethod
    def of(cls, configfiles: Sequence[str], settings: Sequence[str]) -> "Subject":
        """Subject of the configuration given by files and settings, else that of the last run.

        Raises
        ------
        ConfigurationError
            A configuration file is missing or is not a mapping.
        """
        files = ["--configfile", *configfiles] if configfiles else []
        options = [*files, *(["--config", *settings] if settings else [])] or recall()
        command = CommandLine.parse(options)
        check_files([DEFAULT, *command.configfiles])
        return cls(tuple(options), folders(command.configfiles, command.settings))

    @property
    def results(self) -> str:
        """Path of the results folder."""
        return self.folders.results

    def command(self, *targets: str) -> str:
        """Command that makes the ``targets`` of this configuration; all files without targets."""
        ends = ["--", *targets] if targets and self.options else targets
        return shlex.join(["./reproduce", *self.options, *ends])

    @cached_property
    def plan(self) -> Plan:
        """Plan of the configuration, merged from its files and settings as by Snakemake."""
        command = CommandLine.parse(self.options)
        whole = merged(Path(DEFAULT), command.configfiles, command.settings)
        return load_plan(whole, Path(), command.configfiles, folders=self.folders, quiet=True)
