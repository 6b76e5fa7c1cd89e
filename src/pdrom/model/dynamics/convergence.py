"""Error of a frame: how far its last iterate is from the converged frame with the same start.

A local and a global step map an iterate y to G(y); the converged frame is the fixed point y + d.
With r = G(y) - y and the derivative G' at y, (I - G') d = r to first order. The estimate is |d| of
the Galerkin solution in the Krylov space of r (Saad 1981), with differences of G. The error is |d|
over the displacement |y - q|, at least `REST` times the extent, in mass-weighted root mean squares.
"""

from contextlib import suppress
from time import perf_counter
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError

from pdrom.core.yamlfile import ConfigModel, describe
from pdrom.model.compiled.dots import dot
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, flat
from pdrom.model.dynamics.stepper import Observer, State, Stepper

DIRECTIONS, EVERY, BEGIN = 10, 20, 10  # of the Krylov space; frames 10, 30, 50, ... are estimated
STEP = 1e-7  # length of differences of G, over the extent: rounding errors and curvature stay small
REST = 1e-6  # least displacement in the denominator, over the extent, for bodies at rest


class Until(ConfigModel):
    """Iterate each frame until its estimated error is at most ``error``, or ``most`` times."""

    error: Annotated[float, Field(ge=1e-8, lt=1.0)]
    most: Annotated[int, Field(ge=1, le=10_000)] = 2000


def _until(entry: Any) -> Any:
    try:
        return Until.model_validate(entry) if isinstance(entry, dict) else entry
    except ValidationError as error:
        raise ValueError(describe(error, Until)) from error


Iterations = Annotated[Annotated[int, Field(ge=1, le=10_000)] | Until, BeforeValidator(_until)]


@compiled(nogil=True)
def add_direction(basis, slopes, j, image, reached, own, ahead):
    """Orthonormalise the change of ``image`` to row j + 1 of ``basis``; step ``image`` along it."""
    new = basis[j + 1]
    for i in range(len(new)):
        new[i] = (image[i] - reached[i]) / ahead[i]
    for k in range(j + 1):
        part = slopes[k, j] = dot(basis[k], new)
        for i in range(len(new)):
            new[i] -= part * basis[k, i]
    length = slopes[j + 1, j] = np.sqrt(dot(new, new))
    scale = 1.0 / length if length else 0.0
    for i in range(len(new)):
        new[i] *= scale
        image[i] = own[i] + ahead[i] * new[i]


def frame_error(y: Any, converged: Any, before: Any, masses: np.ndarray, extent: float) -> float:
    """Return the error of a frame from ``before`` to ``y``, (N, 3) m, as defined in the module."""
    root = np.sqrt(masses / masses.sum())[:, None]
    far, moved = (float(np.linalg.norm(root * (y - other))) for other in (converged, before))
    return far / max(moved, REST * extent)


class EstimatingStepper(Stepper):
    """Full-order step loop that estimates the error of every 20th frame; results do not change.

    With ``until``, a frame has 10, 20, 40, ... or all iterations, until its error is small enough.
    ``extent`` (m) is the mesh's longest side; other arguments are those of `Stepper`. ``errors``
    maps frames to errors; ``worst`` is the largest, its frame and the state before it.
    """

    def __init__(self, until: Until | None, extent: float, frames: int, *a: Any, **k: Any) -> None:
        super().__init__(*a, **k)
        self._until, self._extent, self._first = until, extent, min(BEGIN, frames - 1)
        inertia = self.space.system.inertia  # type: ignore[attr-defined]
        self._scale = np.repeat(np.sqrt(inertia / inertia.sum()), WIDTH)
        self._directions = max(1, min(DIRECTIONS, 4 * self.iterations // 5))
        self._basis = np.zeros((self._directions + 1, len(self._scale)))
        self.errors: dict[int, float] = {}
        self.worst: tuple[float, int, State] | None = None

    def step(self, state: State, frame: int, on_last_iterate: Observer = None) -> Any:
        self._due = self._until is not None or frame % EVERY == self._first
        if not self._due:
            return super().step(state, frame, on_last_iterate)
        self._start = flat(state.positions)
        after = super().step(state, frame, on_last_iterate or (lambda y: None))  # uses `_iterate`
        if self._found > (self.worst[0] if self.worst else -1.0):
            self.worst = self._found, frame, state
        self.errors[frame] = self._found
        return after

    def _iterate(self, s: Any, base: Any, system: Any, seconds: Any, watch: Any) -> Any:
        if self._until is None:
            y, objective = super()._iterate(s, base, system, seconds, watch)
            if self._due:
                self._found = self._error(y, s, base, system)
            return y, objective
        started, y, done = perf_counter(), self.space.copy(s), 0
        while done == 0 or (done < self.iterations and self._found > self._until.error):
            more = min(done or BEGIN, self.iterations - done)
            self._advance(more, y, s, base, system)
            done += more
            self._found = self._error(y, s, base, system)
        watch(y)
        seconds[1] += perf_counter() - started
        return y, np.empty(0)

    def _advance(self, count: int, y: np.ndarray, s: Any, base: Any, system: Any) -> None:
        """Do the last ``count`` iterations of a frame, with a new history of the acceleration."""
        if self._acceleration is not None:
            self._acceleration.begin_frame(y)
        which, seconds = range(self.iterations - count, self.iterations), np.zeros(4)
        if self._compiled is not None and self._compiled.takes(system):
            self._compiled.run(which, which.stop, np.empty(0), y, s, base, system, seconds)
            return
        for k in which:
            self._in_python(k, (s, base, y), system, np.empty(which.stop), seconds)

    def _error(self, y: np.ndarray, *frame: Any) -> float:
        """Return the estimated error of a ``frame`` (s, base, system) with last iterate ``y``."""
        own, trial, count = flat(y), self.space.copy(y), self._directions
        image, ahead = flat(trial), STEP * self._extent / self._scale
        basis, slopes = self._basis, np.zeros((count + 1, count))
        with np.errstate(all="ignore"):  # a run that blew up has no estimate
            self._advance(1, trial, *frame)
            reached = image.copy()
            residual = self._scale * (reached - own)
            first = np.sqrt(dot(residual, residual))
            basis[0] = residual / (first or 1.0)
            image[:] = own + ahead * basis[0]
            for j in range(count):
                self._advance(1, trial, *frame)
                add_direction(basis, slopes, j, image, reached, own, ahead)
            moved = np.linalg.norm(self._scale * (own - self._start))
        with suppress(np.linalg.LinAlgError):
            found = np.linalg.solve(np.eye(count) - slopes[:count], first * np.eye(count)[0])
            return float(np.linalg.norm(found)) / max(float(moved), REST * self._extent)
        return np.inf
