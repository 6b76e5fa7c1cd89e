"""Parse and check Snakemake's command line, and record the configuration of the last run.

The configuration files are checked before Snakemake reads them. Snakemake itself would silently use
the last one of two equal keys, run code from a file with the key ``__use_yte__``, and show a
traceback for a file that is not text.
"""

import io
import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, suppress
from itertools import takewhile
from pathlib import Path
from typing import Any

from yaml import YAMLError

from pdrom.core.errors import INTERRUPTED, ConfigurationError, PdromError, reason
from pdrom.core.yamlfile import read_yaml, require_as_written, shown
from study.pipeline.folders import folders

# Options with which Snakemake prints or draws something and runs no job.
LOOKS_ONLY = (
    "dryrun", "lint", "list_rules", "list_target_rules", "print_compilation", "containerize",
    "dag", "rulegraph", "filegraph", "d3dag", "list_conda_envs", "list_changes",
    "list_input_changes", "list_params_changes", "list_untracked", "summary", "detailed_summary",
    "archive", "generate_unit_tests",
)  # fmt: skip
# Options about Snakemake's output; with one of them, this output is not replaced by short lines.
OWN_OUTPUT = ("logger", "quiet", "verbose", "printshellcmds", "debug_dag")
# Options of every run. Snakemake's default scheduler solves an integer program to choose jobs. This
# takes more time than it saves because jobs are short; the greedy scheduler chooses fast.
OPTIONS = ("--scheduler", "greedy", "--rerun-incomplete")
CORES, LINES = ("--cores", "all"), ("--logger", "pdrom")
TEMPLATE_KEY = "__use_yte__"
RECORD = Path(".snakemake/last_run.json")


class CommandLine:
    """Options of Snakemake's command line that this project evaluates.

    Raises ConfigurationError for a wrong option or wrong value, which may be meant as a target.

    looks_only : True if no job runs and no result is written
    plans : True for a dry run (``-n``) without any other option of `LOOKS_ONLY`
    makes : True if jobs run or a dry run lists them; False for ``--touch``, too
    more : options that this project adds
    executor : Snakemake's executor, from command line or profile; None: jobs run on this machine
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        found = parsed(arguments)
        looks = [name for name in LOOKS_ONLY if found[name]]
        reports = bool(found["report"] or found["reporter"]) and not found["report_after_run"]
        self.arguments = tuple(arguments)
        self.configfiles, self.settings, self.targets = (
            tuple(map(str, found[name] or ())) for name in ("configfile", "config", "targets")
        )
        self.looks_only = bool(looks) or reports
        self.plans = looks == ["dryrun"]
        self.makes = (self.plans or not self.looks_only) and not found["touch"]
        own_output = any(found[name] is not None and found[name] for name in OWN_OUTPUT)
        cores = found["cores"] is not None or found["jobs"] is not None
        lines = self.makes and not own_output
        self.more = [*(() if cores else CORES), *(LINES if lines else ()), *OPTIONS]
        self.executor: str | None = found["executor"]
        for key, _, text in (setting.partition("=") for setting in self.settings):
            with suppress(YAMLError):  # Snakemake reads a value that is not YAML as text
                require_as_written(text, "--config", key)

    @property
    def configuration(self) -> list[str]:
        """Command-line options that select the configuration; empty for the default one."""
        files = ["--configfile", *self.configfiles] if self.configfiles else []
        return [*files, *(["--config", *self.settings] if self.settings else [])]

    def rewritten(self, more: Sequence[str], made: Mapping[str, Sequence[str]]) -> list[str]:
        """Return the arguments and the options ``more``, with files ``made[target]`` as targets."""
        targets = dict.fromkeys(file for target in self.targets for file in made[target])
        options = list(self.arguments)[: [*self.arguments, "--"].index("--")]
        # without "--", targets may stand anywhere among the options: remove each of them once
        for target in () if "--" in self.arguments else self.targets:
            options.remove(target)
        return [*options, *more, *(["--", *targets] if targets else [])]


def parsed(arguments: Sequence[str]) -> dict[str, Any]:
    """Return the options that Snakemake finds in ``arguments`` and the profiles that they name."""
    # not imported at the top, because jobs import this module and need no parser
    from snakemake.cli import parse_args, parse_config

    said, fault = io.StringIO(), ""
    try:
        with redirect_stderr(said):
            found = vars(parse_args(list(arguments))[1])
            parse_config(found["config"])
    except SystemExit as end:
        if not end.code:
            raise  # after --help or --version
        fault = said.getvalue().strip().rpartition("rror: ")[2]
    except Exception as error:
        fault = f"{' '.join(arguments)}: {error}"
    if fault:
        more = ".venv/bin/snakemake --help lists the options; write -- before targets"
        raise ConfigurationError(f"{fault} ({more})")
    return found


def completed(arguments: Sequence[str]) -> list[str]:
    """Return ``arguments`` with the options that Snakemake needs, and files in place of names."""
    # not imported at the top, because it loads NumPy, before which environment variables are set
    from study.pipeline.targets import figure_file, files

    if "figure" in arguments:
        at = list(arguments).index("figure")
        named = list(takewhile(lambda word: not word.startswith("-"), arguments[at + 1 :]))
        others = [*arguments[:at], *arguments[at + 1 + len(named) :]]
        arguments = [*others, *([] if "--" in others else ["--"]), *map(figure_file, named or [""])]
    command = CommandLine(arguments)
    check_files(command.configfiles)
    own = folders(command.configfiles, command.settings)
    made = {target: files(target, own) for target in command.targets}
    for target, found in made.items():
        if found != [target]:
            sys.stderr.write(f"reproduce: {target}: {', '.join(found)}\n")
    return command.rewritten(command.more, made)


def check_files(paths: Iterable[str | Path]) -> None:
    """Raise ConfigurationError if a file is not a mapping or has the key that enables templates."""
    for path in map(Path, paths):
        content = read_yaml(path)
        if not isinstance(content, dict):
            found = "nothing" if content is None else shown(content, 60)
            raise ConfigurationError(f"{path}: a mapping of keys is required, found {found}")
        if TEMPLATE_KEY in content:
            raise ConfigurationError(f"{path}: {TEMPLATE_KEY}: templates are not allowed")


@contextmanager
def one_line() -> Iterator[None]:
    """Within this context, end the process with one line if a user's input or a file is faulty."""
    try:
        yield
    except PdromError as error:
        sys.exit(f"pdrom: {error}")
    except OSError as error:
        sys.exit(f"pdrom: {error.filename or 'a file'}: {reason(error)}")
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        sys.exit(INTERRUPTED)


def remember(command: CommandLine) -> None:
    """Write the options that select the configuration of ``command`` to the file `RECORD`."""
    RECORD.write_text(json.dumps(command.configuration), encoding="utf-8")


def recall() -> list[str]:
    """Return the options that select the last run's configuration; [] for the default or no run."""
    return list(json.loads(RECORD.read_text("utf-8"))) if RECORD.is_file() else []
