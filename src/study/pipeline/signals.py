"""Signals that end a run, each with one line and an exit code of its own.

``./reproduce`` imports this module before all others, which takes a few milliseconds.
"""

import os
import shutil
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NoReturn

KEPT = "what is finished is kept, and the same command goes on from there"
# Signals that end a run, and the words of its last line; its exit code is 128 plus the number.
ENDINGS = {
    signal.SIGINT: "interrupted",
    signal.SIGTERM: "ended by SIGTERM",
    signal.SIGHUP: "ended by SIGHUP",
}


def leave(number: int, _frame: object = None) -> NoReturn:
    """Handler of the signal ``number``: end this process with one line, and so the fork server."""
    with suppress(OSError):  # nobody may read the stream any more; sys.stderr may be redirected
        os.write(2, ending(number).encode())
    if "multiprocessing.util" in sys.modules:  # the folder with the socket of the fork server
        shutil.rmtree(sys.modules["multiprocessing.util"].get_temp_dir(), ignore_errors=True)
    os._exit(128 + number)


def handle(handler: Callable[[int, Any], Any] | signal.Handlers) -> None:
    """Install the ``handler`` of all signals in `ENDINGS` that nohup or a shell does not ignore."""
    for number in ENDINGS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def ending(number: int) -> str:
    """Last line of a run that the signal ``number`` ended."""
    return f"pdrom: {ENDINGS[signal.Signals(number)]}; {KEPT}\n"
