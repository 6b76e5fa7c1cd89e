"""``./reproduce ARGS...``: Snakemake with this project's options, names and words.

``python -m study.pipeline.front`` does what the console command ``snakemake`` does, after the
arguments were completed and the configuration files were checked. ``figure`` as the first
argument names figures by their number in the manuscript or in the preprint; ``verify`` compares
what was made with what is expected; ``test`` hands the others to pytest, and ``run`` starts a
program of the environment.
"""

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from pdrom.core.environment import settle
from pdrom.core.errors import INTERRUPTED, PdromError
from study.pipeline.commandline import CommandLine, check_files, recall
from study.pipeline.folders import folders
from study.pipeline.running import end_at_sigterm

# Snakemake's default scheduler solves an integer program for each choice among the jobs; they are
# short, so that this takes longer than it saves.
OPTIONS = ("--scheduler", "greedy", "--rerun-incomplete")

LINES = ("--logger", "pdrom")

# First arguments that hand the others on, with the modules that get them.
HANDED_ON = {
    "test": "pytest",
    "verify": "study.verification.command",
    "bundle": "study.verification.bundle",
}


def completed(arguments: Sequence[str]) -> list[str]:
    """Complete the ``arguments`` of the command line for Snakemake.

    Raises
    ------
    ConfigurationError
        A configuration file is missing or no mapping; a target was taken for an option's value;
        there is no such figure.
    """
    if arguments[:1] == ["figure"]:
        from study.pipeline.targets import figure_arguments  # it loads the whole package

        arguments = figure_arguments(arguments[1:])
    command = CommandLine.parse(arguments)
    if command.report and not command.configfiles and not command.settings and recall():
        _say(f"a report of the last run, {' '.join(recall())}")
        command = CommandLine.parse(command.rewritten(recall(), {t: [t] for t in command.targets}))
    check_files(command.configfiles)
    cores = () if command.cores else ("--cores", "all")
    replaced = command.plans or not command.looks_only
    lines = LINES if replaced and not command.own_output else ()
    return command.rewritten([*cores, *lines, *OPTIONS], _made(command))


def _made(command: CommandLine) -> dict[str, list[str]]:
    """Files to make for each target of ``command``, which are said where the target is a name."""
    own = folders(command.configfiles, command.settings)
    if not command.targets:
        return {}
    from study.pipeline.targets import described, files  # late, as above

    made = {target: files(target, own) for target in command.targets}
    for target, found in made.items():
        if found != [target]:
            _say(f"{described(target)}: {', '.join(found)}")
    return made


def _say(line: str) -> None:
    sys.stderr.write(f"reproduce: {line}\n")


def _start(command: Sequence[str]) -> NoReturn:
    """Become a program of the environment, found as the shell finds it."""
    if not command:
        sys.exit(
            "pdrom: run: the name of a program is missing, as in: ./reproduce run pdrom --help"
        )
    try:
        os.execvp(command[0], list(command))
    except OSError as error:
        sys.exit(f"pdrom: run: {command[0]}: {error.strerror}")


def main() -> None:
    """Run Snakemake or the tests; end the process with their status."""
    settle()
    word = sys.argv[1] if sys.argv[1:] else ""
    if word in HANDED_ON:
        _start([sys.executable, "-m", HANDED_ON[word], *sys.argv[2:]])
    if word == "run":
        _start(sys.argv[2:])
    end_at_sigterm()
    try:
        arguments = completed(sys.argv[1:])
        sys.argv = ["snakemake", *arguments]
        from snakemake.cli import main as snakemake

        snakemake(arguments)
    except PdromError as error:
        sys.exit(f"pdrom: {error}")
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
