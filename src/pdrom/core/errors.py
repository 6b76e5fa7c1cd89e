"""Error classes; a message is one line with the file or object, key, value and allowed values."""

import errno
import os
import re
from collections.abc import Iterable
from difflib import get_close_matches

INTERRUPTED = 130  # exit status of a program that ends by Ctrl-C


def choices(value: object, allowed: Iterable[object]) -> str:
    """Return the end of a message about an invalid ``value``: ``allowed`` names and the closest."""
    names = [str(name) for name in allowed]
    return f" (allowed: {', '.join(names)}){suggestion(value, names)}"


def suggestion(value: object, allowed: Iterable[str]) -> str:
    """Return the end of a message about an invalid ``value``: the closest ``allowed`` name."""
    close = get_close_matches(str(value), list(dict.fromkeys(allowed)), n=1)
    return f", did you mean '{close[0]}'?" if close else ""


def reason(error: OSError) -> str:
    """Return the system's message for ``error``, even if HDF5 gives its number only in the text."""
    hidden = re.search(r"errno = (\d+)", str(error))
    number = error.errno or (int(hidden[1]) if hidden else 0)
    return os.strerror(number) if number in errno.errorcode else " ".join(str(error).split())[:200]


class PdromError(Exception):
    """Base of every error that a user's input can cause; shown to the user without a traceback.

    Its text is one line, whatever user input it quotes: line separators are escaped, and a word of
    a thousand characters or more is shortened to its first 80.
    """

    def __str__(self) -> str:
        text = re.sub(r"(\S{80})\S{920,}", r"\1...", super().__str__())
        return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class ConfigurationError(PdromError):
    """A configuration file holds an unknown key, a wrong type or a value outside its range."""


class MeshError(PdromError):
    """A mesh is unreadable or invalid: for example, it has vertices that no element uses."""


class DegenerateElementError(MeshError):
    """An element at rest has zero length, area or volume, so that its strain is not defined."""


class SceneError(PdromError):
    """A scene is contradictory, or its mesh lacks the vertices or cells that an effect needs."""


class NotReducibleError(SceneError):
    """A scene cannot be reduced: an effect prevents it, nothing moves, or no model is accurate."""


class SolverError(PdromError):
    """The global system cannot be factored or solved."""


class SnapshotError(PdromError):
    """Snapshots are missing, not finite or of the wrong shape."""


class RankError(PdromError):
    """More modes were requested than the snapshots have singular values above rounding errors."""


class SamplingError(PdromError):
    """Sampled entries or elements are out of range, repeated or too few."""


class StorageError(PdromError):
    """A file is missing, truncated or not of the expected layout."""


class PaperError(PdromError):
    """The manuscript cannot be built."""
