"""Outcomes of the last ``./reproduce verify``, for the pages of the article."""

from collections.abc import Mapping
from pathlib import Path

from pdrom.core.store import write_text
from pdrom.view.page import safe_json

NAME = "verified.js"
INDEX = "index.html"


def write_verified(found: Mapping[str, str], folder: Path) -> None:
    """Write the outcomes ``found``, by kind and name as in ``table payoff``, into ``folder``.

    A page that is opened from a disk loads nothing but scripts, so that this is one.
    """
    write_text(f"window.pdromVerified={safe_json(dict(found))};\n", folder / NAME)
