"""Hard matrices, by class: what S q of one element may look like at its worst."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Make = Callable[[np.random.Generator, int], np.ndarray]


@dataclass(frozen=True)
class MatrixClass:
    """A class of matrices (rows, 3).

    unique : whether the nearest point of the manifold is unique; if not, only its distance is
    rows : numbers of rows for which the class differs from others
    """

    name: str
    make: Make
    unique: bool = True
    rows: tuple[int, ...] = (2, 3)


def rotation(rng: np.random.Generator) -> np.ndarray:
    """Uniformly distributed rotation (3, 3), drawn by ``rng``."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def with_singular_values(*values: float) -> Make:
    """Random matrices with the signed singular values given (the first ``rows`` of them)."""

    def make(rng: np.random.Generator, rows: int) -> np.ndarray:
        left = rotation(rng) if rows == 3 else _turn(rng)
        return left @ np.diag(values[:rows]) @ rotation(rng)[:rows]

    return make


def _turn(rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _random(size: float) -> Make:
    return lambda rng, rows: size * rng.standard_normal((rows, 3))


def _last_row(size: float) -> Make:
    """A row that is ``size`` times the others: exactly representable, however small."""

    def make(rng: np.random.Generator, rows: int) -> np.ndarray:
        d = rng.standard_normal((rows, 3))
        d[rng.integers(rows)] *= size
        return d

    return make


def _ill_scaled(rng: np.random.Generator, rows: int) -> np.ndarray:
    return rng.standard_normal((rows, 3)) * 10.0 ** rng.uniform(-8, 8, (rows, 3))


def _half_turn(rng: np.random.Generator, rows: int) -> np.ndarray:
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    turn = 2.0 * np.outer(axis, axis) - np.eye(3)
    frame = rotation(rng)
    stretch = frame.T @ np.diag([1.3, 1.0, 0.8]) @ frame
    return (turn @ stretch)[:rows]


def _rank_one(rng: np.random.Generator, rows: int) -> np.ndarray:
    return np.outer(rng.integers(1, 9, rows), rng.integers(1, 9, 3)).astype(float)


def _mirror(rng: np.random.Generator, rows: int) -> np.ndarray:
    d = np.zeros((3, 3))
    d[np.arange(3), rng.permutation(3)] = 1.0
    d[0] *= -np.linalg.det(d)
    return d[:rows]


CLASSES = (
    MatrixClass("random", _random(1.0)),
    MatrixClass("in range", with_singular_values(1.005, 1.0, 0.995)),
    MatrixClass("nearly singular (1e-8)", with_singular_values(1.0, 0.7, 1e-8)),
    MatrixClass("nearly singular (1e-16)", with_singular_values(1.0, 0.7, 1e-16)),
    MatrixClass("one column times 1e-100", _last_row(1e-100)),
    MatrixClass("one column times 1e-300", _last_row(1e-300)),
    MatrixClass("nearly rank one (1e-6)", with_singular_values(1.0, 1e-6, 4e-7)),
    MatrixClass("repeated", with_singular_values(1.3, 1.3, 1.3)),
    MatrixClass("nearly repeated (1e-9)", with_singular_values(1.3, 1.3 + 1e-9, 1.3 - 1e-9)),
    MatrixClass("rotation by pi", _half_turn),
    MatrixClass("inverted", with_singular_values(1.2, 1.0, -0.6)),
    MatrixClass("nearly mirrored (1e-6)", with_singular_values(1.2, 1.0, -1.0 + 1e-6), rows=(3,)),
    MatrixClass("ill-scaled", _ill_scaled),
    MatrixClass("huge (1e150)", _random(1e150)),
    MatrixClass("tiny (1e-150)", _random(1e-150)),
    MatrixClass("mirrored", _mirror, unique=False, rows=(3,)),
    MatrixClass("rank one", _rank_one, unique=False),
    MatrixClass("zero", lambda rng, rows: np.zeros((rows, 3)), unique=False),
)

VECTORS = (
    MatrixClass("random", _random(1.0)),
    MatrixClass("ill-scaled", _ill_scaled),
    MatrixClass("huge (1e300)", _random(1e300)),
    MatrixClass("tiny (1e-300)", _random(1e-300)),
    MatrixClass("zero", lambda rng, rows: np.zeros((rows, 3)), unique=False),
)
