"""Checks of arguments of `pdrom.api` before anything is computed; errors name the argument."""

import os
from pathlib import Path
from typing import Any, TypeVar

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import shown

T = TypeVar("T")


def require(kind: type[T] | tuple[type[T], ...], value: Any, name: str, source: str) -> T:
    """Return ``value`` if it is of the type ``kind``, else raise ConfigurationError.

    The error names the argument (``name``) and tells what makes such a value (``source``).
    """
    if isinstance(value, kind):
        return value
    kinds = " or ".join(k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,)))
    raise ConfigurationError(f"{name} = {shown(value, 60)}: a {kinds} is required ({source})")


def file_path(path: Any) -> Path:
    """Return ``path`` as a `Path`; ConfigurationError if it cannot be one."""
    if not isinstance(path, (str, os.PathLike)) or "\0" in str(path):
        raise ConfigurationError(f"{shown(path, 60)}: the name of a file is required")
    return Path(path)
