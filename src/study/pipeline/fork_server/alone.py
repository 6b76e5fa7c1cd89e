"""Run a script in an interpreter of its own, which ends when the run that wants it has ended.

A killed run closes its end of a pipe (`study.pipeline.fork_server.hold_pipe`), on every platform.
This file is run by its path and imports little.
"""

import os
import runpy
import signal
import sys
import threading

PIPE = "PDROM_RUN_PIPE"


def main() -> None:
    """Run the script that the arguments name as the main module."""
    if pipe := os.environ.get(PIPE):
        threading.Thread(target=end_with, args=(pipe,), daemon=True).start()
    del sys.argv[0]
    sys.path[0] = os.path.dirname(sys.argv[0])
    runpy.run_path(sys.argv[0], run_name="__main__")


def end_with(pipe: str) -> None:
    """End this job with the run, which alone writes to ``pipe`` and never does."""
    try:
        # without O_NONBLOCK a pipe that nobody writes to any more would not be opened
        number = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        os.set_blocking(number, True)
        os.read(number, 1)
    finally:
        os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    main()
