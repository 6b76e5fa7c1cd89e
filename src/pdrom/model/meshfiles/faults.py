"""Faults of mesh files, and the checks that readers share."""

import re
from collections.abc import Iterable

# Kinds of cells that are wanted, and how many corners they have.
CORNERS = {"triangle": 3, "tetra": 4}
_LAST_NUMBER = re.compile(rb"(?:^|\s)([-+]?[\d.]+(?:[eE][-+]?\d*)?)\Z")


class UnreadableError(ValueError):
    """A file that is no mesh of its format, or one that would be read wrong."""


class RefusedError(ValueError):
    """A mesh that is read, and is not what is wanted."""


class CutError(UnreadableError):
    """A file that ends before its mesh does."""

    def __init__(self, why: str) -> None:
        super().__init__(f"cut off: {why}")


def only_kind(kinds: Iterable[str]) -> str:
    """The one kind of cells of a mesh among ``kinds``; `RefusedError` for none or another."""
    found = list(dict.fromkeys(kinds))
    if len(found) != 1 or found[0] not in CORNERS:
        raise RefusedError(
            f"holds cells {found or 'of no kind'}, allowed: only one of {', '.join(CORNERS)}"
        )
    return found[0]


def check_last_number(content: bytes, vertices: int) -> None:
    """`CutError` if the text ``content`` ends in what may be the beginning of a longer number.

    Only the end of the line distinguishes ``12`` from the first digits of ``123``. An index that
    could not be longer, as there are not so many ``vertices``, is taken.
    """
    last = _LAST_NUMBER.search(content[-64:])
    if last is None:
        return
    number = last[1].decode()
    digits = number.lstrip("+-")
    if not digits.isdigit() or 0 < 10 * int(digits) <= vertices:
        raise CutError(
            f"the last line has no end and may go on after {number} (add an end of line if not)"
        )


def reason(error: BaseException) -> str:
    """Message of an error, on one short line."""
    text = " ".join(str(error).split())[:200]
    if isinstance(error, UnreadableError):
        return text
    if isinstance(error, SystemExit):
        return "no reader takes it"
    return f"{type(error).__name__}: {text}"
