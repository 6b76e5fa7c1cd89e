"""Parsing and checking of Snakemake's command line, and a record of the last run's configuration.

The configuration files are checked before Snakemake reads them. Snakemake itself would silently use
the last one of two equal keys, run code from a file with the key ``__use_yte__``, and show a
traceback for a file that is not text.
"""

import inspect
import io
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, suppress
from itertools import takewhile
from pathlib import Path
from typing import Any

from yaml import YAMLError

from pdrom.core.errors import INTERRUPTED, ConfigurationError, PdromError
from pdrom.core.yamlfile import read_yaml, require_as_written, shown
from study.pipeline.folders import folders
from study.pipeline.running import blocked

# Options with which Snakemake only prints or draws something and runs no job.
LOOKS_ONLY = (
    "dryrun", "lint", "list_rules", "list_target_rules", "print_compilation", "containerize",
    "dag", "rulegraph", "filegraph", "d3dag", "list_conda_envs", "list_changes",
    "list_input_changes", "list_params_changes", "list_untracked", "summary", "detailed_summary",
    "archive", "generate_unit_tests",
)  # fmt: skip
# Options about Snakemake's output; if one is given, our short log lines do not replace this output.
OWN_OUTPUT = ("logger", "quiet", "verbose", "printshellcmds", "debug_dag")
# Options of every run. The greedy scheduler chooses jobs fast. Snakemake's default scheduler solves
# an integer program at each choice, which takes more time than it saves, since jobs are short.
OPTIONS = ("--scheduler", "greedy", "--rerun-incomplete")
LINES = ("--logger", "pdrom")
# Options with numbers that are at least one; others are at least zero.
COUNTS = ("cores", "jobs", "local_cores", "max_threads")
# Keys that Snakemake accepts after --config.
KEY = re.compile(r"[A-Za-z_][\w-]*\w")
YAML = (".yaml", ".yml", ".json")
TEMPLATE_KEY = "__use_yte__"
RECORD = Path(".snakemake/last_run.json")


class CommandLine:
    """Options of Snakemake's command line that this project evaluates.

    Raises ConfigurationError for a wrong option, or a target that was read as an option's value.

    arguments : the whole command line
    configfiles : files given by the option ``--configfile``, in order
    settings : ``key=value`` pairs given by the option ``--config``
    targets : names of files and rules to make
    report : file given by the option ``--report``, None without the option
    looks_only : True if no job runs and no result is written
    plans : True for a dry run (``-n``) without any other option of `LOOKS_ONLY`
    own_output : True if an option of `OWN_OUTPUT` is given
    makes : True if results are made or a dry run plans to; False with ``--touch``, too
    cores : True if a number of cores or jobs is given
    executor : Snakemake's executor, from command line or profile; None runs jobs on this machine
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        found = parsed(arguments)
        looks = [name for name in LOOKS_ONLY if found[name]]
        reports = bool(found["report"] or found["reporter"]) and not found["report_after_run"]
        self.arguments = tuple(arguments)
        self.configfiles, self.settings, self.targets = (
            tuple(map(str, found[name] or ())) for name in ("configfile", "config", "targets")
        )
        self.report = str(found["report"]) if found["report"] and reports else None
        self.looks_only = bool(looks) or reports
        self.plans = looks == ["dryrun"]
        self.makes = (self.plans or not self.looks_only) and not found["touch"]
        self.own_output = any(found[name] is not None and found[name] for name in OWN_OUTPUT)
        self.cores = found["cores"] is not None or found["jobs"] is not None
        self.executor: str | None = found["executor"]
        for key, _, text in (setting.partition("=") for setting in self.settings):
            with suppress(YAMLError):  # Snakemake takes such a value as a text
                require_as_written(text, "--config", key)
        swallowed = [name for name in self.settings if "=" not in name]
        swallowed += [name for name in self.configfiles[1:] if Path(name).suffix not in YAML]
        if swallowed:
            raise ConfigurationError(
                f"'{swallowed[0]}': no KEY=VALUE or YAML file, as the option before it takes; "
                "write two hyphens before the targets: ./reproduce OPTIONS -- TARGETS"
            )
        for key in (setting.partition("=")[0] for setting in self.settings):
            if not KEY.fullmatch(key):
                raise ConfigurationError(f"--config {key}=...: no such key (see config/README.md)")

    @property
    def configuration(self) -> list[str]:
        """Options that name the configuration; an empty list for the default configuration."""
        files = ["--configfile", *self.configfiles] if self.configfiles else []
        return [*files, *(["--config", *self.settings] if self.settings else [])]

    def rewritten(self, more: Sequence[str], made: Mapping[str, Sequence[str]]) -> list[str]:
        """Arguments plus the options ``more``; the files ``made[target]`` replace each target."""
        targets = dict.fromkeys(file for target in self.targets for file in made[target])
        options = _before_targets(self.arguments)
        # without "--", targets may stand anywhere among the options: remove each of them once
        for target in () if "--" in self.arguments else self.targets:
            options.remove(target)
        return [*options, *more, *(["--", *targets] if targets else [])]


def parsed(arguments: Sequence[str]) -> dict[str, Any]:
    """Return the options that Snakemake finds in ``arguments`` and the profiles that they name."""
    # not imported at the top: jobs import this module, too, and need no parser
    from snakemake.cli import parse_args

    said, fault = io.StringIO(), ""
    try:
        with redirect_stderr(said):
            found = vars(parse_args(list(arguments))[1])
    except SystemExit as end:
        if not end.code:
            raise  # after --help or --version
        fault = said.getvalue().strip().splitlines()[-1].rpartition("rror: ")[2]
    except Exception as error:
        # the parser's function for an option has its name and values
        calls = [each.frame.f_locals for each in inspect.trace(0) if each.function == "take_action"]
        words = [[call["option_string"], *call["argument_strings"]] for call in calls]
        fault = f"{' '.join(words[-1]) if words else 'options'}: {error}"
    else:
        options = [word.partition("=")[0] for word in _before_targets(arguments)]
        if sum(each == "--config" for each in options) > 1:
            fault = "--config is given twice; write all settings after the first"
        if sum(each.startswith("--configf") for each in options) > 1:
            fault = "--configfile is given twice; write all files after the first"
        if found["config"] == []:
            fault = "--config: KEY=VALUE is missing"
        for name, value in found.items():
            least = int(name in COUNTS)
            if isinstance(value, int | float) and value < least and value is not False:
                fault = f"--{name.replace('_', '-')} {value}: at least {least} is required"
    if fault:
        raise ConfigurationError(f"{fault} (.venv/bin/snakemake --help explains the options)")
    return found


def _before_targets(arguments: Sequence[str]) -> list[str]:
    """Return the arguments before the separator ``--``, or all of them without one."""
    return list(arguments)[: [*arguments, "--"].index("--")]


def completed(arguments: Sequence[str]) -> list[str]:
    """Return ``arguments`` with the options that Snakemake needs, and files in place of names."""
    if "figure" in arguments:
        from study.pipeline.targets import figure_files  # slow, so not imported at the top

        at = list(arguments).index("figure")
        named = list(takewhile(lambda word: not word.startswith("-"), arguments[at + 1 :]))
        others = [*arguments[:at], *arguments[at + 1 + len(named) :]]
        options = _before_targets(others)
        arguments = [*options, "--", *others[len(options) + 1 :], *figure_files(named)]
    command = CommandLine(arguments)
    if command.report and not command.configuration and recall():
        sys.stderr.write(f"reproduce: a report of the last run, {' '.join(recall())}\n")
        command = CommandLine(command.rewritten(recall(), {t: [t] for t in command.targets}))
    check_files(command.configfiles)
    cores = () if command.cores else ("--cores", "all")
    lines = LINES if command.makes and not command.own_output else ()
    own, made = folders(command.configfiles, command.settings), {}
    if command.targets:
        from study.pipeline.targets import files  # slow, so not imported at the top

        made = {target: files(target, own) for target in command.targets}
        # print the files if a target is a name and not a path
        for target, found in made.items():
            if found != [target]:
                sys.stderr.write(f"reproduce: {target}: {', '.join(found)}\n")
    return command.rewritten([*cores, *lines, *OPTIONS], made)


def check_files(paths: Iterable[str | Path]) -> None:
    """Raise ConfigurationError if a file is no mapping or has the key that enables templates."""
    for path in map(Path, paths):
        content = read_yaml(path)
        if not isinstance(content, dict):
            found = "nothing" if content is None else shown(content, 60)
            raise ConfigurationError(f"{path}: a mapping of keys is required, found {found}")
        if TEMPLATE_KEY in content:
            raise ConfigurationError(f"{path}: {TEMPLATE_KEY}: templates are not allowed")


@contextmanager
def one_line() -> Iterator[None]:
    """Context in which an error of users or files ends the process with a message of one line."""
    try:
        yield
    except PdromError as error:
        sys.exit(f"pdrom: {error}")
    except OSError as error:
        sys.exit(f"pdrom: {PdromError(blocked(error))}")
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        sys.exit(INTERRUPTED)


def remember(command: CommandLine) -> None:
    """Write the configuration options of ``command``, which is about to run, to file `RECORD`."""
    # not imported at the top: it loads NumPy, and environment variables must be set before
    from pdrom.core.store import write_text

    write_text(json.dumps(command.configuration) + "\n", RECORD)


def recall() -> list[str]:
    """Options that name the last run's configuration; [] for the default, or without a last run."""
    try:
        record = json.loads(RECORD.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return record if isinstance(record, list) and all(isinstance(r, str) for r in record) else []
