"""Deviations of a run from the full-order run: norms in each frame, and errors over all frames.

Positions, velocities, shapes (the difference after the best rigid motion of each frame, Kabsch
1976) and the total energy are compared.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from pdrom.model import metrics
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.energy import STRIDE, EnergyScale
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene
from pdrom.reduction.rerun import Rerun, displacement_norms, rerun, step_norms

# Names of series over frames: of a full-order run; of another run, or of the difference of both.
CONVERGED = ("displacement_converged", "deformed_converged")
REFERENCE = ("displacement", "deformed", "step", "energy", *CONVERGED)
DEVIATIONS = (
    "difference", "shape_difference", "step_difference", "energy", "difference_converged",
    "shape_difference_converged",
)  # fmt: skip
ERRORS = (
    "relative_error_within_horizon", "deformation_error", "error_over_extent", "shape_error",
    "velocity_error", "energy_drift", "error_converged", "deformation_converged",
)  # fmt: skip
Series = Mapping[str, np.ndarray]


class Reduced(Protocol):
    """A reduced model, which makes the step loop of a scene and maps its unknowns to positions."""

    def loop(self, scene: Scene) -> tuple[Stepper, State]: ...

    def positions(self, y: np.ndarray) -> np.ndarray: ...

    def output(self) -> Callable[[np.ndarray], np.ndarray] | None: ...


class Yardstick:
    """A full-order run with which other runs of its scene are compared.

    scene : scene of the full-order run
    reference : (F + 1, N, 3) m, positions of the full-order run; entry 0 is the initial state
    converged : positions of a run with converged frames, for a second comparison
    """

    def __init__(
        self, scene: Scene, reference: np.ndarray, converged: np.ndarray | None = None
    ) -> None:
        self.scene, self.reference = scene, reference
        self.converged = None if converged is None else Yardstick(scene, converged)

    @cached_property
    def displacement(self) -> np.ndarray:
        """Frobenius norm (F,) m of the displacements from the initial state in each frame."""
        return displacement_norms(self.reference)

    @cached_property
    def deformed(self) -> np.ndarray:
        """Norm (F,) m of the difference in shape from the rest shape in each frame."""
        return metrics.shape_differences(
            self.scene.mesh.points, self.reference[1:], self.scene.masses
        )

    @cached_property
    def scale(self) -> EnergyScale:
        """Energy scale: 0 is the least potential of forces of the full-order run, 1 its peak."""
        return EnergyScale.of(self.scene, self.reference)

    @cached_property
    def series(self) -> dict[str, np.ndarray]:
        """Per-frame series of the full-order run for the argument ``reference`` of `errors_within`.

        ``displacement``, ``deformed`` (F,) m; ``step`` (F,) m, see `step_norms`; ``energy`` in
        every `STRIDE`-th frame and the last, scaled by `scale`; `CONVERGED`: the first two of the
        converged run, empty without it.
        """
        limit = self.converged
        others = [np.zeros(0)] * 2 if limit is None else [limit.displacement, limit.deformed]
        blocks = _blocks(self.reference, self.reference)
        return {
            "displacement": self.displacement,
            "deformed": self.deformed,
            "step": np.concatenate([step_norms(q) for q, _ in blocks]),
            "energy": self.scale.own,
            **dict(zip(CONVERGED, others, strict=True)),
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
        """Extent norm and `rest_size`, m: keyword arguments of `errors_within`.

        The extent norm is that of a shift of all N vertices by the mesh's longest side.
        """
        mesh = self.scene.mesh
        size = metrics.rest_size(mesh.points, self.scene.masses)
        norm = mesh.extent * float(np.sqrt(mesh.vertices))
        return {"extent_norm": norm, "rest_norm": size}

    def errors(self, positions: np.ndarray, end: int) -> tuple[float | None, float | None]:
        """Compute position and deformation error of ``positions`` (F' + 1, N, 3) m up to ``end``.

        Both errors are None if the run ended earlier.
        """
        if len(positions) <= end:
            return None, None
        difference, shapes = self.differences(positions[: end + 1])
        size = self.units["rest_norm"]
        return (
            metrics.trajectory_error(difference, self.displacement[:end]),
            metrics.relative_deformation(shapes, self.deformed[:end], size),
        )

    def differences(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute norms (F',) of position and shape differences; ``positions`` (F' + 1, N, 3) m."""
        blocks, masses = _blocks(positions, self.reference), self.scene.masses
        apart = [np.linalg.norm((q - p)[1:], axis=(1, 2)) for q, p in blocks]
        shapes = [metrics.shape_differences(q[1:], p[1:], masses) for q, p in blocks]
        return np.concatenate(apart), np.concatenate(shapes)

    def deviations(self, outcome: Rerun) -> dict[str, np.ndarray]:
        """Compute deviations of the run ``outcome`` from the full-order run in each of F' frames.

        ``difference``, ``shape_difference`` (without rigid motion), ``step_difference`` (of changes
        of the positions in a frame): (F',) m, norms of the differences of both runs, the first two
        also from the converged run (empty without it). ``energy`` is that of ``outcome``, in every
        `STRIDE`-th frame and the last, scaled by `scale`.
        """
        limit = self.converged
        with np.errstate(over="ignore", invalid="ignore"):
            blocks = _blocks(outcome.positions, self.reference)
            steps = [step_norms(q - p) for q, p in blocks]
            shapes = self.differences(outcome.positions)[1]
            others = limit.differences(outcome.positions) if limit else (np.zeros(0), np.zeros(0))
        return {
            "difference": outcome.difference,
            "shape_difference": shapes,
            "step_difference": np.concatenate(steps),
            "energy": self.scale.relative(outcome.positions),
            **dict(zip(DEVIATIONS[-2:], others, strict=True)),
        }


def errors_within(
    run: Series, reference: Series, end: int, extent_norm: float, rest_norm: float
) -> dict[str, float | None]:
    """Return a mapping of column names to the errors over the frames before number ``end``.

    An error is None if the run ended earlier or the full-order run lacks the quantity. ``run``
    comes from `Yardstick.deviations`, ``reference`` from `Yardstick.series`, norms from `units`.
    """
    if len(run["difference"]) < end:
        return dict.fromkeys(ERRORS)
    displacement, shape = reference["displacement"], run["shape_difference"]
    # energies of the start, every STRIDE-th frame and, if all frames count, the last
    drift, within = None, slice(None if end == len(displacement) else end // STRIDE + 1)
    if len(reference["energy"][within]) > 1:
        drift = float(np.abs(run["energy"][within] - reference["energy"][within]).max())

    def over_extent(difference: np.ndarray) -> float | None:
        """RMS of ``difference`` / ``extent_norm`` in the first ``end`` frames; None if end = 0."""
        return float(np.sqrt(np.mean(np.square(difference[:end] / extent_norm)))) if end else None

    found = (
        error_within(run["difference"], displacement, end),
        metrics.relative_deformation(shape[:end], reference["deformed"][:end], rest_norm),
        over_extent(run["difference"]),
        over_extent(shape),
        error_within(run["step_difference"], reference["step"], end),
        drift,
        error_within(run["difference_converged"], reference["displacement_converged"], end),
        metrics.relative_deformation(
            run["shape_difference_converged"][:end],
            reference["deformed_converged"][:end],
            rest_norm,
        ),
    )
    return dict(zip(ERRORS, found, strict=True))


def error_within(difference: np.ndarray, displacement: np.ndarray, end: int) -> float | None:
    """Compute the relative error over ``end`` frames; None if fewer ran or nothing moved.

    ``difference`` (F',) and ``displacement`` (F,) are norms as `metrics.trajectory_error` takes.
    """
    if len(difference) < end:
        return None
    return metrics.trajectory_error(difference[:end], displacement[:end])


def _blocks(positions: np.ndarray, reference: np.ndarray) -> list[tuple[Any, Any]]:
    """Split both runs into parts of `BLOCK` frames, each with the state before its first frame."""
    starts = range(0, max(len(positions) - 1, 1), metrics.BLOCK)
    ends = (min(start + metrics.BLOCK + 1, len(positions)) for start in starts)
    return [(positions[s:e], reference[s:e]) for s, e in zip(starts, ends, strict=True)]
