"""Exit codes of the commands of this package."""

import sys
from collections.abc import Callable
from enum import IntEnum

from pdrom.core.errors import INTERRUPTED, PdromError


class Status(IntEnum):
    """End of a command; argparse ends with 2 for a command that it does not understand."""

    HOLDS = 0
    FAULTY = 1
    DIFFERS = 3
    MISSING = 4


def ended(command: Callable[[], int]) -> int:
    """Exit code of ``command``; faulty input and an interruption are one line."""
    try:
        return command()
    except (PdromError, OSError) as error:
        sys.stderr.write(f"pdrom: {error}\n")
        return Status.FAULTY
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        return INTERRUPTED


def say(line: str) -> None:
    """Print a ``line``."""
    sys.stdout.write(f"{line}\n")
