"""Orthographic camera and the window of a picture."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


class Window(NamedTuple):
    """Visible rectangle in the picture plane, metres."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Width, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height, m."""
        return self.top - self.bottom

    def contains(self, flat: np.ndarray) -> np.ndarray:
        """Mark the picture points ``flat`` (n, 2) that lie inside, (n,) bool."""
        x, y = flat.T
        return (x >= self.left) & (x <= self.right) & (y >= self.bottom) & (y <= self.top)

    def resized(self, width: float, height: float) -> "Window":
        """Window of another ``width`` and ``height`` about the same centre."""
        x, y = 0.5 * (self.left + self.right), 0.5 * (self.bottom + self.top)
        return Window(x - 0.5 * width, x + 0.5 * width, y - 0.5 * height, y + 0.5 * height)


@dataclass(frozen=True)
class Camera:
    """Parallel projection; y points up.

    azimuth : degrees about the y axis; 0 looks along -z, 90 along -x
    elevation : degrees above the horizon
    """

    azimuth: float = 30.0
    elevation: float = 20.0

    @cached_property
    def basis(self) -> np.ndarray:
        """Rows: right, up, towards the eye; a rotation matrix (3, 3)."""
        a, e = np.radians([self.azimuth, self.elevation])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        eye = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
        return np.stack([right, np.cross(eye, right), eye])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Picture coordinates (n, 2), m, of points (n, 3)."""
        return points @ self.basis[:2].T

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Distance of ``points`` (n, 3) m towards the eye (n,), m: larger is nearer."""
        return points @ self.basis[2]


def bounds(flat: np.ndarray, margin: float = 0.08) -> Window:
    """Smallest window of picture points ``flat`` (n, 2), with a relative ``margin`` around."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = margin * max(float((high - low).max()), 1e-12)
    return Window(low[0] - pad, high[0] + pad, low[1] - pad, high[1] + pad)


def window_of(camera: Camera, clouds: Iterable[np.ndarray], margin: float = 0.08) -> Window:
    """Window by ``camera`` that shows all ``clouds`` (n, 3); ``margin`` as in `bounds`."""
    return bounds(np.concatenate([camera.project(cloud) for cloud in clouds]), margin)
