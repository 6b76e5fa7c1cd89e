"""Directions of a scene's picture: up, and towards the eye."""

from collections.abc import Sequence

import numpy as np

from pdrom.model.effects.base import EffectConfig
from pdrom.model.effects.gravity import Gravity

Y = np.array([0.0, 1.0, 0.0])
EYE = np.array([0.85, 0.55, 1.45])  # direction to the viewer where y points up


def up_of(effects: Sequence[EffectConfig]) -> np.ndarray:
    """Unit vector (3,) against the gravity among ``effects`` of a scene; y where it has none."""
    pull = sum(
        (np.array(e.acceleration) for e in effects if isinstance(e, Gravity.Config)), 0.0 * Y
    )
    strength = float(np.linalg.norm(pull))
    return -pull / strength if strength > 0.0 else Y


def rotation_to(up: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) that takes y to the unit vector ``up``; half a turn about x."""
    cosine = float(up @ Y)
    if cosine <= -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = np.cross(Y, up)
    square = float(x * x + y * y + z * z)
    if square == 0.0:
        return np.eye(3)
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # not divided by 1 + cosine, which loses all digits near half a turn
    return np.eye(3) + turn + turn @ turn * ((1.0 - cosine) / square)


def view_of(effects: Sequence[EffectConfig]) -> dict[str, list[float]]:
    """``up`` and ``eye`` of the picture of a scene with these effects, each (3,)."""
    up = up_of(effects)
    return {"up": up.tolist(), "eye": (rotation_to(up) @ EYE).tolist()}
