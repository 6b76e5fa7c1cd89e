"""Run a script in an interpreter of its own, which ends when the run that started it has ended.

The run keeps one end of a pipe open (`study.pipeline.fork_server.hold_pipe`). A killed run closes
it, on every platform. This file is started by its path and imports only the standard library.
"""

import os
import runpy
import signal
import sys
import threading

PIPE = "PDROM_RUN_PIPE"


def main() -> None:
    """Run the script whose path is the first argument as the main module."""
    if pipe := os.environ.get(PIPE):
        threading.Thread(target=end_with, args=(pipe,), daemon=True).start()
    del sys.argv[0]
    sys.path[0] = os.path.dirname(sys.argv[0])
    runpy.run_path(sys.argv[0], run_name="__main__")


def end_with(pipe: str) -> None:
    """Kill this job when the run ends, which closes ``pipe``: only the run opens it to write."""
    try:
        # without O_NONBLOCK, open would wait for a writer if the run has already ended
        number = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        os.set_blocking(number, True)
        os.read(number, 1)
    finally:
        os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    main()
