"""``./reproduce ARGS...``: Snakemake with the options, target names and messages of this project.

``python -m study.pipeline.front`` completes the arguments, checks the configuration files, and then
does what the console command ``snakemake`` does. Some first arguments are special: ``figure``
selects figures by their number in the manuscript or in the preprint; ``verify`` compares results
with the expected ones; ``bundle`` writes an archive; ``test`` passes the other arguments to pytest;
``run`` starts a program found on PATH, such as pdrom.
"""

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from pdrom.core.environment import settle
from pdrom.core.errors import INTERRUPTED
from study.pipeline.commandline import CommandLine, check_files, one_line, recall
from study.pipeline.folders import folders

# Options of every run. The greedy scheduler chooses jobs fast. Snakemake's default scheduler solves
# an integer program at each choice, which takes more time than it saves, since jobs are short.
OPTIONS = ("--scheduler", "greedy", "--rerun-incomplete")

LINES = ("--logger", "pdrom")

# First argument of ``./reproduce`` -> module that is run with the remaining arguments.
HANDED_ON = {
    "test": "pytest",
    "verify": "study.verification.command",
    "bundle": "study.verification.bundle",
}


def completed(arguments: Sequence[str]) -> list[str]:
    """Return the ``arguments`` of the command line with the options that Snakemake needs.

    Raises ConfigurationError if a configuration file is missing or is not a mapping, a target was
    read as the value of an option, or a figure does not exist.
    """
    if arguments[:1] == ["figure"]:
        from study.pipeline.targets import figure_arguments  # slow, so not imported at the top

        arguments = figure_arguments(arguments[1:])
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


def _start(command: Sequence[str]) -> NoReturn:
    """Replace this process by program ``command[0]``, found on PATH, with the other arguments."""
    if not command:
        sys.exit("pdrom: run: no program is named, as in: ./reproduce run pdrom --help")
    try:
        os.execvp(command[0], list(command))
    except OSError as error:
        sys.exit(f"pdrom: run: {command[0]}: {error.strerror}")


def main() -> None:
    """Run Snakemake, or the module or program that the first argument selects, and exit."""
    settle()
    word = sys.argv[1] if sys.argv[1:] else ""
    if word in HANDED_ON:
        _start([sys.executable, "-m", HANDED_ON[word], *sys.argv[2:]])
    if word == "run":
        _start(sys.argv[2:])
    try:
        with one_line():
            arguments = completed(sys.argv[1:])
            sys.argv = ["snakemake", *arguments]
            from snakemake.cli import main as snakemake

            snakemake(arguments)
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
