"""Orthographic camera, window of a picture, upward direction, and obstacles in view."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pdrom.model.effects.base import EffectConfig
from pdrom.model.effects.forces import Gravity
from pdrom.model.mesh.types import Mesh

ROOM = 0.2  # margin around the bounding box of a run, relative to its longest side
Y = np.array([0.0, 1.0, 0.0])  # default upward direction


class Window(NamedTuple):
    """Visible rectangle in the picture plane, metres."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Width of the rectangle, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height of the rectangle, m."""
        return self.top - self.bottom

    def contains(self, flat: np.ndarray) -> np.ndarray:
        """Return whether the window contains each picture point of ``flat`` (n, 2) m, (n,) bool."""
        x, y = flat.T
        return (x >= self.left) & (x <= self.right) & (y >= self.bottom) & (y <= self.top)

    def resized(self, width: float, height: float) -> "Window":
        """Return a window with the same centre and the given ``width`` and ``height``, m."""
        x, y = 0.5 * (self.left + self.right), 0.5 * (self.bottom + self.top)
        return Window(x - 0.5 * width, x + 0.5 * width, y - 0.5 * height, y + 0.5 * height)


@dataclass(frozen=True)
class Camera:
    """Parallel projection, turned by `rotation_to` if ``up`` is not y.

    azimuth : degrees about the upward axis; if that is y, 0 looks along -z and 90 along -x
    elevation : degrees of the eye above the plane normal to ``up``; 90 looks straight down
    up : unit vector that points up in the picture
    """

    azimuth: float = 30.0
    elevation: float = 20.0
    up: tuple[float, ...] = (0.0, 1.0, 0.0)

    @cached_property
    def basis(self) -> np.ndarray:
        """Rotation matrix (3, 3); its rows are the directions right, up and towards the eye."""
        a, e = np.radians([self.azimuth, self.elevation])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        eye = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
        return np.stack([right, np.cross(eye, right), eye]) @ rotation_to(np.array(self.up)).T

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return picture coordinates (n, 2), m, of points (n, 3)."""
        return points @ self.basis[:2].T

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return the coordinate (n,) m of ``points`` (n, 3) m towards the eye; larger is nearer."""
        return points @ self.basis[2]


def bounds(flat: np.ndarray, margin: float = 0.08) -> Window:
    """Return a window of points ``flat`` (n, 2) m, widened by ``margin`` times its length."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = margin * max(float((high - low).max()), 1e-12)
    return Window(low[0] - pad, high[0] + pad, low[1] - pad, high[1] + pad)


def window_of(camera: Camera, clouds: Iterable[np.ndarray], margin: float = 0.08) -> Window:
    """Return the window of all points in ``clouds`` (n, 3) m, widened as in `bounds`."""
    return bounds(np.concatenate([camera.project(cloud) for cloud in clouds]), margin)


def up_of(effects: Sequence[EffectConfig]) -> np.ndarray:
    """Return the unit vector (3,) opposite to the gravity in ``effects``; y without gravity."""
    pulls = [np.array(e.acceleration) for e in effects if isinstance(e, Gravity.Config)]
    pull = sum(pulls, 0.0 * Y)
    strength = float(np.linalg.norm(pull))
    return -pull / strength if strength > 0.0 else Y


def rotation_to(up: np.ndarray) -> np.ndarray:
    """Return the least rotation (3, 3) that takes y to the unit vector ``up``; about x for -y."""
    cosine = float(up @ Y)
    if cosine <= -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = np.cross(Y, up)
    square = float(x * x + y * y + z * z)
    if square == 0.0:
        return np.eye(3)
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # this form does not divide by 1 + cosine, which has no correct digits near half a turn
    return np.eye(3) + turn + turn @ turn * ((1.0 - cosine) / square)


def shown_region(
    positions: np.ndarray, effects: Sequence[EffectConfig]
) -> tuple[np.ndarray, np.ndarray]:
    """Return two corners, m, of a cube with a margin around ``positions`` (F, N, 3) m of a run.

    An obstacle among the ``effects`` that reaches into the margin lies completely in the cube,
    unless it is larger than the run. Parts of runs and obstacles outside the cube are not shown.
    """
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    size = float((high - low).max())
    for body in (effect.body(low, high) for effect in effects):
        if body is None:
            continue
        lower, upper = body.points.min(axis=0), body.points.max(axis=0)
        near = (lower <= high + ROOM * size).all() and (upper >= low - ROOM * size).all()
        if near and (upper - lower).max() <= size:
            low, high = np.minimum(low, lower), np.maximum(high, upper)
    middle, half = 0.5 * (low + high), (0.5 + ROOM) * float((high - low).max())
    return middle - half, middle + half


def obstacles(positions: np.ndarray, effects: Sequence[EffectConfig]) -> list[Mesh]:
    """List surfaces of obstacles in the `shown_region` of a run, the largest (hindmost) first."""
    region = shown_region(positions, effects)
    found = [body for effect in effects if (body := effect.body(*region))]
    return sorted(found, key=lambda body: -float(np.ptp(body.points, axis=0).max()))
