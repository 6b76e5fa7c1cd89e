"""``pdrom COMMAND ...``: the parser, messages and exit codes; each command is one module.

The module declares its arguments as a `Command` and imports other modules when the command runs.
"""

import argparse
import logging
import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module

from pdrom import __version__
from pdrom.command.base import Command, Status
from pdrom.core import checkout
from pdrom.core.environment import settle
from pdrom.core.errors import INTERRUPTED, PdromError, choices, reason

COMMANDS = ("new", "run", "train", "cost", "view", "show")
CODES = """exit codes: 0 success; 1 invalid input, or a file that cannot be read or written;
2 invalid command line; 3 a reduced run blew up (its result is still written);
130 interrupted"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    plain = argparse.RawDescriptionHelpFormatter
    top = argparse.ArgumentParser(
        prog="pdrom",
        description="Simulate elastic bodies by projective dynamics, and train reduced models.",
        epilog=f"{CODES}\n\nexample: pdrom new sheet.yaml && pdrom run sheet.yaml",
        formatter_class=plain,
    )
    top.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    below = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in COMMANDS:
        command: Command = import_module(f"pdrom.command.{name}").COMMAND
        own = below.add_parser(
            name, help=command.title, description=command.title, formatter_class=plain,
            epilog=f"example: {command.example}",
        )  # fmt: skip
        for argument, keywords in command.arguments.items():
            own.add_argument(argument, **keywords)
        own.set_defaults(perform=command.perform, parser=own)
    return top


def run(arguments: Sequence[str]) -> int:
    """Run the command that ``arguments`` name; return the exit code."""
    try:
        try:
            found = _parsed(arguments)
            return int(found.perform(found))
        finally:
            sys.stdout.flush()  # a failed write is reported here instead of at exit
    except PdromError as error:
        return _fail(str(error))
    except MemoryError:
        return _fail("out of memory")
    except BrokenPipeError:  # the reader of the output has closed the pipe
        _drop_output()
        return Status.DONE
    except OSError as error:
        _drop_output()
        return _fail(f"{error.filename or 'standard output'}: {reason(error)}")
    except BaseException as error:
        cause: BaseException | None = error
        while cause and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__context__  # an interrupt during compilation raises Numba's errors
        if cause is None:
            raise
        sys.stderr.write("\npdrom: interrupted\n")
        return INTERRUPTED


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    top = parser()
    if arguments and arguments[0][:1] != "-" and arguments[0] not in COMMANDS:
        top.error(f"unknown command '{arguments[0]}'{choices(arguments[0], COMMANDS)}")
    found, unknown = top.parse_known_args(arguments)
    if hasattr(found, "runs"):  # argparse does not assign files after an option
        found.runs += [word for word in unknown if word[:1] != "-"]
        unknown = [word for word in unknown if word[:1] == "-"]
    if unknown:
        known = re.findall(r"--[a-z-]+", found.parser.format_usage())
        found.parser.error(f"unknown argument {unknown[0]}{choices(unknown[0], known)}")
    return found


def _drop_output() -> None:
    """Discard the rest of the output: flushing it at exit would fail again."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str) -> int:
    sys.stderr.write(f"pdrom: {message}\n")
    return Status.FAULTY


def main() -> None:
    """Set environment variables (`settle`), run the command line, and exit with its exit code."""
    root = checkout()
    if root and os.access(root / ".cache", os.W_OK):  # compiled kernels are shared with ./reproduce
        os.environ.setdefault("NUMBA_CACHE_DIR", str(root / ".cache" / "numba"))
        os.environ.setdefault("MPLCONFIGDIR", str(root / ".cache" / "matplotlib"))
    settle()
    # a stream that the caller closed is None here; the next file opened would get its descriptor
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    logging.basicConfig(format="%(message)s")
    for name in ("pdrom.api", "pdrom.reduction.timing"):
        logging.getLogger(name).setLevel(logging.INFO)
    sys.exit(run(sys.argv[1:]))
