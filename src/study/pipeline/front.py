"""``./reproduce ARGS...``: Snakemake with the options, target names and messages of this project.

``python -m study.pipeline.front`` completes the arguments, checks the configuration files, and then
does what the console command ``snakemake`` does. Some first arguments are special: ``verify``
compares results with the expected ones; ``bundle`` writes an archive; ``test`` passes the other
arguments to pytest; ``run`` starts a program found on PATH, such as pdrom.
"""

import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from study.pipeline.signals import handle, leave

# First argument of ``./reproduce`` -> module that is run with the remaining arguments.
HANDED_ON = {
    "test": "pytest",
    "verify": "study.verification.command",
    "bundle": "study.verification.bundle",
}


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
    handle(leave)
    # other modules are not imported at the top: until here, a signal ends this without a word
    from pdrom.core.environment import settle

    settle()
    word = sys.argv[1] if sys.argv[1:] else ""
    if word in HANDED_ON:
        _start([sys.executable, "-m", HANDED_ON[word], *sys.argv[2:]])
    if word == "run":
        _start(sys.argv[2:])
    sys.stderr.write("reproduce: planning\n")
    from logging import getLogger

    from study.pipeline.commandline import completed, one_line
    from study.pipeline.failures import plain

    with one_line():
        sys.argv = ["snakemake", *completed(sys.argv[1:])]
    if "--verbose" not in sys.argv:
        getLogger("snakemake.logging").addFilter(plain)
    from snakemake.cli import main as snakemake

    snakemake(sys.argv[1:])


if __name__ == "__main__":
    main()
