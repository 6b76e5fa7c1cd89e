"""Provenance inside HDF5 files, figures and the manuscript, as it is written and read again.

PDF has a dictionary of information. Matplotlib writes its standard keys only, so that the
provenance of a figure is its keywords; TeX may write a key of its own. PNG has text fields.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import h5py
from PIL import Image

from pdrom.core.provenance import RECORD, as_text

PDF_KEY = "Keywords"
TEX_KEY = "Provenance"
PNG_KEY = "Provenance"
_IN_PDF = re.compile(rb"/(?:%s|%s) ?\(((?:[^\\()]|\\.)*)\)" % (PDF_KEY.encode(), TEX_KEY.encode()))


def tex_of(record: Mapping[str, str]) -> str:
    """TeX that puts a record into the PDF; it is plain text without parentheses."""
    return rf"\pdfinfo{{/{TEX_KEY} (\detokenize{{{as_text(record)}}})}}" + "\n"


def embedded(path: Path) -> dict[str, str]:
    """The record inside an HDF5, PDF or PNG file; empty where there is none."""
    match path.suffix:
        case ".h5" | ".hdf5":
            with h5py.File(path, "r") as file:
                return {name: value for name, value in file.attrs.items() if name in RECORD}
        case ".png":
            with Image.open(path) as picture:
                return _record(str(getattr(picture, "text", {}).get(PNG_KEY, "")))
        case ".pdf":
            found = (_record(_plain(text)) for text in _IN_PDF.findall(path.read_bytes()))
            return next(filter(None, found), {})
    return {}


def _plain(text: bytes) -> str:
    """Text of a string of PDF, whose backslash takes the next sign as it is."""
    return re.sub(rb"\\(.)", rb"\1", text).decode("latin-1")


def _record(text: str) -> dict[str, str]:
    try:
        record = json.loads(text)
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
