"""Exit codes of ``./reproduce verify``."""

from enum import IntEnum


class Status(IntEnum):
    """End of a command; argparse ends with 2 for a command that it does not understand."""

    HOLDS = 0
    FAULTY = 1
    DIFFERS = 3
    MISSING = 4
