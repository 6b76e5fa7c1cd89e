"""Setting damaged files aside: for jobs of the workflow alone, whose next run makes them again.

Nobody else renames a file that it reads: it may be the only copy of somebody's run.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_ASIDE: ContextVar[bool] = ContextVar("damaged results are set aside", default=False)


@contextmanager
def damaged_set_aside() -> Iterator[None]:
    """Damaged results that are read meanwhile are set aside."""
    previous = _ASIDE.set(True)
    try:
        yield
    finally:
        _ASIDE.reset(previous)


def sets_aside() -> bool:
    """Whether a damaged result that is read now is set aside."""
    return _ASIDE.get()
