"""Run Snakemake for ``./reproduce ARGS...``, with options, target names and messages of pdrom.

The arguments are completed, the configuration files are checked, and Snakemake is run. If the first
argument is a key of `HANDED_ON`, its program is run instead.
"""

import os
import sys

from study.pipeline.signals import handle, leave

# First argument of ``./reproduce`` -> program that is run with the remaining arguments.
HANDED_ON = {
    "test": (sys.executable, "-m", "pytest"),
    "verify": (sys.executable, "-m", "study.verification.command", "verify"),
    "bundle": (sys.executable, "-m", "study.verification.command", "bundle"),
    "number": (sys.executable, "-m", "study.verification.number"),
    "run": ("env",),
}


def main() -> None:
    """Run Snakemake, or the module or program that the first argument selects, and exit."""
    handle(leave)
    # other modules are imported only now: before `handle`, a signal would end this without a line
    from pdrom.core.environment import settle

    settle()
    if sys.argv[1:] and sys.argv[1] in HANDED_ON:
        command = [*HANDED_ON[sys.argv[1]], *sys.argv[2:]]
        os.execvp(command[0], command)
    sys.stderr.write("reproduce: planning\n")
    from study.pipeline.commandline import completed, one_line

    with one_line():
        sys.argv = ["snakemake", *completed(sys.argv[1:])]
    from snakemake.cli import main as snakemake

    snakemake(sys.argv[1:])


if __name__ == "__main__":
    main()
