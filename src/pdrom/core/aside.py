"""Renaming damaged results: only jobs of the workflow do it, whose next run makes them again.

Nobody else renames a file that it reads: it may be the only copy of somebody's run.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_ASIDE: ContextVar[bool] = ContextVar("damaged results are set aside", default=False)


@contextmanager
def damaged_set_aside() -> Iterator[None]:
    """Inside this context a damaged result that is read is renamed to ``NAME.damaged``."""
    previous = _ASIDE.set(True)
    try:
        yield
    finally:
        _ASIDE.reset(previous)


def sets_aside() -> bool:
    """Whether a damaged result that is read now is renamed."""
    return _ASIDE.get()
