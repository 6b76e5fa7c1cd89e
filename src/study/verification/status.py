"""Exit codes of the commands ``verify`` and ``bundle``, and their output."""

import sys
from collections.abc import Callable
from enum import IntEnum

from pdrom.core.errors import INTERRUPTED, PdromError


class Status(IntEnum):
    """Exit code of a command; code 2 is argparse's code for an unknown option."""

    HOLDS = 0
    FAULTY = 1
    DIFFERS = 3
    MISSING = 4


def ended(command: Callable[[], int]) -> int:
    """Run ``command`` and return its exit code; report errors and interruption in one line."""
    try:
        return command()
    except (PdromError, OSError) as error:
        sys.stderr.write(f"pdrom: {error}\n")
        return Status.FAULTY
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        return INTERRUPTED


def say(line: str) -> None:
    """Print ``line`` to standard output."""
    sys.stdout.write(f"{line}\n")
