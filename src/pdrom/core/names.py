"""Names that become parts of paths, checked with a sentence a user can act on."""

import os
import re
from pathlib import PurePath
from typing import Annotated, Any

from pydantic import AfterValidator

# What file systems and system calls take, in bytes.
MAX_NAME, MAX_PATH = 255, 4095
_SCENE_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


def _scene_name(name: str) -> str:
    if not _SCENE_NAME.fullmatch(name):
        raise ValueError(
            "a scene's name begins with a small letter and goes on with small letters, digits and "
            "underscores, 64 characters at most"
        )
    return name


def check_lengths(path: str) -> None:
    """ValueError for a path, or a name in it, that is longer than systems take."""
    if len(os.fsencode(path)) > MAX_PATH:
        raise ValueError(f"a path of at most {MAX_PATH} bytes is required")
    for name in PurePath(path).parts:
        if len(os.fsencode(name)) > MAX_NAME:
            raise ValueError(f"names of at most {MAX_NAME} bytes are required")


def name_of(stem: str) -> str:
    """A scene's name from ``stem``, its file's name without the ending, as far as allowed."""
    return re.sub(r"[^a-z0-9_]+", "_", stem.lower()).lstrip("_0123456789")[:64] or "scene"


def named(keys: Any, stem: str) -> Any:
    """``keys`` of a scene's file with a name and a title, made from the file's name ``stem``."""
    if not isinstance(keys, dict):
        return keys
    name = keys.get("name", name_of(stem))
    return {"name": name, "title": str(name).replace("_", " ").capitalize(), **keys}


SceneName = Annotated[str, AfterValidator(_scene_name)]
