"""Deviations of a run from the full-order run: norms in each frame, and errors over all frames.

Positions, velocities, shapes (the difference after the best rigid motion of each frame, Kabsch
1976), the total energy, and the frame of first contact with an obstacle are compared.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.energy import STRIDE, EnergyScale
from pdrom.model.metrics import shape_differences, trajectory_error
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import Rerun, displacement_norms, rerun, step_norms

# Number of frames compared at a time, so that the memory used does not grow with the run.
BLOCK = 32
# A vertex touches an obstacle if it is closer than this fraction of the mesh's longest side, since
# a subspace model does not place vertices exactly on the surface.
TOUCH = 1e-3

# Names of series over frames: of a full-order run; of another run, or its difference from it.
REFERENCE = ("displacement", "step", "energy", "contact")
DEVIATIONS = ("difference", "shape_difference", "step_difference", "energy", "contact")
ERRORS = (
    "relative_error_within_horizon", "error_over_extent", "shape_error", "relative_shape_error",
    "velocity_error", "energy_drift", "contact_delay",
)  # fmt: skip
Series = Mapping[str, np.ndarray]


class Reduced(Protocol):
    """A reduced model, which makes the step loop of a scene and maps its unknowns to positions."""

    def loop(self, scene: Scene) -> tuple[Stepper, State]: ...

    def positions(self, y: np.ndarray) -> np.ndarray: ...


class Yardstick:
    """A full-order run with which other runs of its scene are compared.

    scene : scene of the full-order run
    reference : (F + 1, N, 3) m, positions of the full-order run; entry 0 is the initial state
    """

    def __init__(self, scene: Scene, reference: np.ndarray) -> None:
        self.scene, self.reference = scene, reference

    @cached_property
    def displacement(self) -> np.ndarray:
        """Frobenius norm (F,) m of the displacements from the initial state in each frame."""
        return displacement_norms(self.reference)

    @cached_property
    def scale(self) -> EnergyScale:
        """Energy scale: 0 for the full order's least potential of forces, 1 for its peak total."""
        return EnergyScale.of(self.scene, self.reference)

    @cached_property
    def series(self) -> dict[str, np.ndarray]:
        """Per-frame series of the full-order run for the argument ``reference`` of `errors_within`.

        ``displacement`` (F,) m; ``step`` (F,) m, norm of time step times velocities; ``energy`` in
        every `STRIDE`-th frame and the last, scaled by `scale`; ``contact`` (F,), 1 at contact.
        """
        blocks = [q for q, _ in _blocks(self.reference, self.reference)]
        return {
            "displacement": self.displacement,
            "step": np.concatenate([step_norms(q) for q in blocks]),
            "energy": self.scale.own,
            "contact": np.concatenate([self._touched(q[1:]) for q in blocks]),
        }

    def run(self, model: Reduced, offset: np.ndarray | None = None) -> Rerun:
        """Run the scene with ``model``, from positions moved by ``offset`` (N, 3) m."""
        loop, start = model.loop(self.scene)
        if offset is not None:
            start = replace(start, positions=start.positions + offset)
        reference, limit = self.reference, BLOWUP_EXTENT
        return rerun(self.scene, loop, start, reference, limit, model.positions)

    def row(self, outcome: Rerun) -> dict[str, Any]:
        """Map table columns to results of ``outcome``; no error if the run ended early.

        The error is || Q - Q_fom || / || Q_fom - Q_0 ||, norms over all frames of positions Q.
        """
        end = len(self.displacement)
        error = error_within(outcome.difference, self.displacement, end)
        return {
            "frames": outcome.frames,
            "finite": outcome.finite,
            "blowup_frame": outcome.blowup_frame,
            "max_extent": outcome.max_extent,
            "relative_error": error if outcome.finite else None,
        }

    @property
    def units(self) -> dict[str, float]:
        """Extent norm, m, and time step, s: keyword arguments of `errors_within`.

        The extent norm is the Frobenius norm of a shift of all N vertices by the mesh's longest
        side: sqrt(N) times that side.
        """
        norm = self.scene.mesh.extent * float(np.sqrt(self.reference.shape[1]))
        return {"extent_norm": norm, "time_step": self.scene.config.time_step}

    def deviations(self, outcome: Rerun) -> dict[str, np.ndarray]:
        """Deviations in each of the F' frames of the run ``outcome`` from the full-order run.

        ``difference``, ``shape_difference`` (without rigid motion), ``step_difference`` (of changes
        of the positions in a frame): (F',) m, norms of the differences of both runs. Two series are
        of ``outcome`` alone: ``energy``, every `STRIDE`-th frame and its last, scaled by `scale`
        (empty if the full order's is round-off); ``contact`` (F',), 1 where a vertex touches.
        """
        steps, shapes, contacts = [], [], []
        with np.errstate(over="ignore", invalid="ignore"):
            for q, p in _blocks(outcome.positions, self.reference):
                steps.append(step_norms(q - p))
                shapes.append(shape_differences(q[1:], p[1:]))
                contacts.append(self._touched(q[1:]))
        return {
            "difference": outcome.difference,
            "shape_difference": np.concatenate(shapes),
            "step_difference": np.concatenate(steps),
            "energy": self.scale.relative(outcome.positions),
            "contact": np.concatenate(contacts),
        }

    def _touched(self, positions: np.ndarray) -> np.ndarray:
        """Array (f,): 1 if a vertex touches an obstacle in a frame of ``positions`` (f, N, 3) m.

        Vertices that touch the obstacle in the initial state are ignored.
        """
        near = TOUCH * self.scene.mesh.extent
        touched = np.zeros(len(positions), dtype=np.uint8)
        for contact in self.scene.contacts:
            away = contact.gaps(self.reference[0]) > near
            gaps = contact.gaps(positions.reshape(-1, 3)).reshape(positions.shape[:2])
            touched |= ((gaps <= near) & away).any(axis=1)
        return touched


def errors_within(
    run: Series, reference: Series, end: int, extent_norm: float, time_step: float
) -> dict[str, float | None]:
    """Return a mapping of column names to the errors over the frames before number ``end``.

    An error is None if the run ended earlier or the full-order run lacks the quantity.

    Parameters
    ----------
    run, reference : per-frame series from `Yardstick.deviations` and `Yardstick.series`
    extent_norm, time_step : norm of a shift by the mesh's longest side, m, and time step, s
    """
    if len(run["difference"]) < end:
        return dict.fromkeys(ERRORS)
    displacement, shape = reference["displacement"], run["shape_difference"]
    # energies of the start, every STRIDE-th frame and, if all frames count, the last
    drift, within = None, slice(None if end == len(displacement) else end // STRIDE + 1)
    if len(reference["energy"][within]) > 1:
        drift = float(np.abs(run["energy"][within] - reference["energy"][within]).max())
    # first frame with contact of this run and of the full-order run; inf if there is no contact
    first, wanted = (
        float(np.argmax(touched)) if np.any(touched) else np.inf
        for touched in (run["contact"][:end], reference["contact"][:end])
    )

    def over_extent(difference: np.ndarray) -> float | None:
        """RMS of ``difference`` / ``extent_norm`` in the first ``end`` frames; None if end = 0."""
        return float(np.sqrt(np.mean(np.square(difference[:end] / extent_norm)))) if end else None

    found = (
        error_within(run["difference"], displacement, end),
        over_extent(run["difference"]),
        over_extent(shape),
        error_within(shape, displacement, end),
        error_within(run["step_difference"], reference["step"], end),
        drift,
        None if first == wanted == np.inf else time_step * (first - wanted),
    )
    return dict(zip(ERRORS, found, strict=True))


def error_within(difference: np.ndarray, displacement: np.ndarray, end: int) -> float | None:
    """Relative error over the first ``end`` frames; None if the run has fewer or nothing moved.

    Parameters
    ----------
    difference : (F',) m, norms of the difference between the run and the full-order run
    displacement : (F,) m, norms of the displacement of the full-order run
    """
    if len(difference) < end:
        return None
    return trajectory_error(difference[:end], displacement[:end])


def _blocks(positions: np.ndarray, reference: np.ndarray) -> list[tuple[Any, Any]]:
    """Split both runs into parts of `BLOCK` frames, each with the state before its first frame."""
    starts = range(0, max(len(positions) - 1, 1), BLOCK)
    ends = (min(start + BLOCK + 1, len(positions)) for start in starts)
    return [(positions[s:e], reference[s:e]) for s, e in zip(starts, ends, strict=True)]
