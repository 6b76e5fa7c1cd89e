"""Records with large arrays, shown on one line."""

from dataclasses import fields
from typing import Any

import numpy as np


def brief(record: Any) -> str:
    """The dataclass ``record`` as its name and fields; an array is shown by its shape and type.

    A class takes it as its ``__repr__``.
    """
    shown = ", ".join(f"{f.name}={_shown(getattr(record, f.name))}" for f in fields(record))
    return f"{type(record).__name__}({shown})"


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{' x '.join(map(str, value.shape)) or 'one'} {value.dtype}>"
    return " ".join(repr(value).split())
