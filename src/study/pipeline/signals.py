"""End a run by a signal, with a last line and an exit code for each signal.

``./reproduce`` imports this module before all others, which takes a few milliseconds.
"""

import os
import shutil
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NoReturn

KEPT = "finished results are kept; run the same command again to continue"
# Signals that end a run, and words of the last line; the exit code is 128 plus the signal's number.
ENDINGS = {
    signal.SIGINT: "interrupted",
    signal.SIGTERM: "ended by SIGTERM",
    signal.SIGHUP: "ended by SIGHUP",
}


def leave(number: int, _frame: object = None) -> NoReturn:
    """Handle the signal ``number``: print one line, end this process and the fork server."""
    with suppress(OSError):  # the stream may be closed; sys.stderr may be redirected
        os.write(2, ending(number).encode())
    if "multiprocessing.util" in sys.modules:  # delete the folder with the fork server's socket
        shutil.rmtree(sys.modules["multiprocessing.util"].get_temp_dir(), ignore_errors=True)
    os._exit(128 + number)


def handle(handler: Callable[[int, Any], Any] | signal.Handlers) -> None:
    """Install ``handler`` for the signals in `ENDINGS`, unless nohup or a shell ignores them."""
    for number in ENDINGS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def ending(number: int) -> str:
    """Return the last line of a run that the signal ``number`` ends."""
    return f"pdrom: {ENDINGS[signal.Signals(number)]}; {KEPT}\n"
