"""What a command says of itself."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum


class Status(IntEnum):
    """Exit codes; 2 is argparse's, for what it does not understand."""

    DONE = 0
    FAULTY = 1
    BLEW_UP = 3
    NOTHING_FITS = 4


@dataclass(frozen=True)
class Command:
    """A command of ``pdrom``.

    title : what it does, one line
    example : a call
    declare : adds its arguments to a parser
    perform : does it and returns the exit code
    """

    title: str
    example: str
    declare: Callable[[argparse.ArgumentParser], None]
    perform: Callable[[argparse.Namespace], Status]
