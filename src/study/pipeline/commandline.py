"""The command line: configuration, targets, whether jobs will run; the one of the last run.

The configuration files are checked before Snakemake reads them. It would take the last of two equal
keys without a word, run code that a file asks for (``__use_yte__``), and show a traceback for a
file that is no text.
"""

import json
import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, PdromError
from pdrom.core.yamlfile import read_yaml, shown

# Options with which Snakemake prints or draws something and runs no job.
LOOKS_ONLY = (
    "dryrun", "lint", "list_rules", "list_target_rules", "print_compilation", "containerize",
    "dag", "rulegraph", "filegraph", "d3dag", "list_conda_envs", "list_changes",
    "list_input_changes", "list_params_changes", "list_untracked", "summary", "detailed_summary",
    "archive", "generate_unit_tests",
)  # fmt: skip
# Options whose own output is not to be replaced by one line a job.
OWN_OUTPUT = ("logger", "quiet", "verbose", "printshellcmds", "debug_dag")
YAML = (".yaml", ".yml", ".json")
TEMPLATE_KEY = "__use_yte__"
RECORD = Path(".snakemake/last_run.json")


@dataclass(frozen=True)
class CommandLine:
    """Options of Snakemake that this project looks at.

    configfiles : files of ``--configfile``, in order
    settings : ``key=value`` pairs of ``--config``
    targets : names of files and rules
    report : file of ``--report``, None without one
    looks_only : no job runs, nothing that a run makes is written
    plans : the jobs are listed, by ``-n``, and nothing else is looked at
    own_output, cores : what else decides about the options that `./reproduce` adds
    executor : Snakemake's executor, of the command line or its profile; None runs jobs here
    """

    arguments: tuple[str, ...]
    configfiles: tuple[str, ...]
    settings: tuple[str, ...]
    targets: tuple[str, ...]
    report: str | None
    looks_only: bool
    plans: bool
    own_output: bool
    cores: bool
    executor: str | None = None

    @classmethod
    def parse(cls, arguments: Sequence[str]) -> "CommandLine":
        """Parse ``arguments`` by Snakemake's parser, which ends the process for an unknown option.

        Raises
        ------
        ConfigurationError
            A target was taken for a value of ``--config`` or ``--configfile``.
        """
        # imported late: Snakemake's jobs import this module, too, and need no parser
        from snakemake.cli import get_argument_parser

        found = vars(get_argument_parser().parse_args(list(arguments)))
        if found["profile"]:
            found |= _of_profile(arguments, found["profile"])
        looks = [name for name in LOOKS_ONLY if found[name]]
        reports = bool(found["report"] or found["reporter"]) and not found["report_after_run"]
        command = cls(
            arguments=tuple(arguments),
            configfiles=_texts(found["configfile"]),
            settings=_texts(found["config"]),
            targets=_texts(found["targets"]),
            report=str(found["report"]) if found["report"] and reports else None,
            looks_only=bool(looks) or reports,
            plans=looks == ["dryrun"],
            own_output=any(found[name] is not None and found[name] for name in OWN_OUTPUT),
            cores=found["cores"] is not None or found["jobs"] is not None,
            executor=found["executor"],
        )
        command._check_values()
        return command

    @property
    def configuration(self) -> list[str]:
        """Options that name the configuration; none for the default one."""
        files = ["--configfile", *self.configfiles] if self.configfiles else []
        return [*files, *(["--config", *self.settings] if self.settings else [])]

    def _check_values(self) -> None:
        swallowed = {
            "--config": [s for s in self.settings if "=" not in s],
            "--configfile": [f for f in self.configfiles[1:] if Path(f).suffix not in YAML],
        }
        for option, names in swallowed.items():
            if names:
                targets = [*names, *self.targets]
                options = [a for a in self.arguments if a not in (*targets, "--")]
                raise ConfigurationError(
                    f"{option} takes every value that follows it, '{names[0]}' too; write two "
                    f"hyphens before the targets: {shlex.join([*options, '--', *targets])}"
                )

    def rewritten(self, more: Sequence[str], made: Mapping[str, Sequence[str]]) -> list[str]:
        """The arguments with more options, and each target replaced by what is made for it."""
        targets = dict.fromkeys(file for target in self.targets for file in made[target])
        options = _before_targets(self.arguments)
        # an option may have the name of a target as its value
        for target in () if "--" in self.arguments else self.targets:
            options.remove(target)
        return [*options, *more, *(["--", *targets] if targets else [])]


def _of_profile(arguments: Sequence[str], profiles: Sequence[str]) -> dict[str, Any]:
    """Cores, jobs and executor, as the command line or a profile sets them."""
    from snakemake.cli import get_argument_parser

    found = vars(get_argument_parser(profiles).parse_args(_before_targets(arguments)))
    return {name: found[name] for name in ("cores", "jobs", "executor")}


def _before_targets(arguments: Sequence[str]) -> list[str]:
    """The arguments before two hyphens, if there are any."""
    return list(arguments)[: [*arguments, "--"].index("--")]


def _texts(values: Any) -> tuple[str, ...]:
    return tuple(str(value) for value in values or ())


def check_files(paths: Iterable[str | Path]) -> None:
    """Read all ``paths``; ConfigurationError for one that is no plain mapping of keys."""
    for path in map(Path, paths):
        content = read_yaml(path)
        if not isinstance(content, dict):
            found = "nothing" if content is None else shown(content, 60)
            raise ConfigurationError(f"{path}: a mapping of keys is required, found {found}")
        if TEMPLATE_KEY in content:
            raise ConfigurationError(f"{path}: {TEMPLATE_KEY}: templates are not allowed")


def merged(default: Path, configfiles: Iterable[str], settings: Iterable[str]) -> dict[str, Any]:
    """The whole configuration, as Snakemake merges it.

    Parameters
    ----------
    default : file of the full study
    configfiles : files of ``--configfile``, in order
    settings : ``key=value`` pairs of ``--config``

    Raises
    ------
    ConfigurationError
        A file is missing or no mapping.
    """
    # imported late: Snakemake's jobs import this module, too
    from snakemake.cli import parse_config
    from snakemake.settings.types import ConfigSettings
    from snakemake.utils import update_config

    files = list(map(Path, configfiles))
    check_files([default, *files])
    whole = dict(read_yaml(default))
    given = ConfigSettings(config=parse_config(tuple(settings)), configfiles=files)
    update_config(whole, given.overwrite_config)
    return whole


@contextmanager
def one_line() -> Iterator[None]:
    """End the process with one line at an error of the user's input."""
    try:
        yield
    except PdromError as error:
        sys.exit(f"pdrom: {error}")


def remember(command: CommandLine) -> None:
    """Write down the configuration of ``command``, which runs."""
    # late: it loads NumPy, which the environment is to be settled before
    from pdrom.core.store import write_text

    write_text(json.dumps(command.configuration) + "\n", RECORD)


def recall() -> list[str]:
    """Options that name the configuration of the last run; none of the default one or of no run."""
    try:
        record = json.loads(RECORD.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return record if isinstance(record, list) and all(isinstance(r, str) for r in record) else []
