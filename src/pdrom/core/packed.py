"""Arrays encoded as text for scripts of a web page, and one-line descriptions of dataclasses."""

import base64
import zlib
from dataclasses import fields
from typing import Any

import numpy as np

LEVELS = 65535  # steps into which `pack_positions` divides each side of the bounding box


def pack_text(values: np.ndarray) -> str:
    """Compress the bytes of the array ``values`` of any shape and type; return base 64 text."""
    return base64.b64encode(zlib.compress(np.ascontiguousarray(values).tobytes(), 9)).decode()


def pack_array(values: np.ndarray, kind: str) -> dict[str, Any]:
    """Pack ``values`` for JSON as numbers of ``kind`` ("f8", "f4", "u4" or "u1"), with shape."""
    shape, data = list(np.shape(values)), np.asarray(values).astype(f"<{kind}")
    return {"kind": kind, "shape": shape, "data": pack_text(data)}


def pack_positions(positions: np.ndarray) -> dict[str, Any]:
    """Quantise ``positions`` (F, N, 3) m in their bounding box; pack changes between frames.

    Quantisation to `LEVELS` steps per side changes a coordinate by at most half a step. Differences
    between frames, modulo 2^16, are stored because they compress better than the positions.
    """
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    step = np.where(high > low, (high - low) / LEVELS, 1.0)
    levels = np.round((positions - low) / step).astype(np.int64)
    changes = np.diff(levels, axis=0, prepend=0) % (LEVELS + 1)
    return {
        "frames": len(positions),
        "vertices": positions.shape[1],
        "low": low.tolist(),
        "step": step.tolist(),
        "changes": pack_text(changes.astype("<u2")),
    }


def brief(record: Any) -> str:
    """Describe the dataclass ``record`` for its repr; show an array by shape and type."""
    shown = []
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            text = f"<{' x '.join(map(str, value.shape)) or 'one'} {value.dtype}>"
        else:
            text = " ".join(repr(value).split())
        shown.append(f"{field.name}={text}")
    return f"{type(record).__name__}({', '.join(shown)})"
