"""Names that become parts of paths, checked with a sentence a user can act on."""

import re
from typing import Annotated

from pydantic import AfterValidator

_SCENE_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


def _scene_name(name: str) -> str:
    if not _SCENE_NAME.fullmatch(name):
        raise ValueError(
            "a scene's name begins with a small letter and goes on with small letters, digits and "
            "underscores, 64 characters at most"
        )
    return name


SceneName = Annotated[str, AfterValidator(_scene_name)]
