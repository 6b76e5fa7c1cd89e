"""A companion: an auxiliary, finer model that runs beside reduced runs and estimates their errors.

The distance of a run to the auxiliary model stands for its distance to the full order (a
hierarchical estimate, Bank and Weiser 1985). If the auxiliary model's own error is at most theta <
1 times that of the run, saturation, then by the triangle inequality the estimate lies between 1 -
theta and 1 + theta times the error. The auxiliary model has the run's own scene and its forces,
contacts and handles, the snapshot modes and as many skinning modes, which a motion that the
training did not hold needs, and sampled elements of its own. It does not depend on the run: one
auxiliary model serves all runs of a motion, and none of them needs the full order.
"""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.runs.bounded import BoundedRun
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements


class CompanionSpec(ConfigModel):
    """A companion: modes of each kind, tolerance tau of its sampling, frames that train it."""

    modes: Annotated[int, Field(ge=1, le=1000)] = 20
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-2
    frames: Annotated[int, Field(ge=1, le=10_000)] = 35


def companion_model(
    scene: Scene, training: np.ndarray, frames: np.ndarray, spec: CompanionSpec
) -> SubspaceModel:
    """Auxiliary model of all runs of a scene.

    Parameters
    ----------
    training : (n, N, 3) m, full-order positions after the training ``frames`` (n,), ascending
    spec : modes, tolerance of the sampling, number of frames
    """
    kind = "pod+skinning"
    columns = make_columns(scene, training, kind, spec.modes)
    chosen = np.linspace(0, len(frames) - 1, min(spec.frames, len(frames))).round().astype(int)
    (samples,) = sample_elements(scene, columns, frames[chosen], [spec.tolerance])
    return SubspaceModel(kind, columns, samples)


def companion_frames(scene: Scene, model: SubspaceModel) -> Iterator[np.ndarray]:
    """Positions (N, 3) m of the auxiliary model in ``scene``, initial ones first, when needed.

    They end with the run, or before the first frame that is not finite.
    """
    loop, start = model.loop(scene)
    frames, unit = scene.config.frames, scene.mesh.extent
    run = BoundedRun(loop.run, start, frames, np.inf, unit, model.positions)
    yield model.positions(start.positions)
    for frame in run:
        yield frame.positions


def companion_run(scene: Scene, model: SubspaceModel) -> np.ndarray:
    """`companion_frames` of the whole run of ``scene`` with ``model``, (F' + 1, N, 3) m."""
    return np.stack(list(companion_frames(scene, model)))


def estimate(positions: np.ndarray, companion: np.ndarray, end: int) -> float | None:
    """Estimated relative error of a run over its frames before ``end``.

    || Q - Q' ||_F / || Q' - Q'_0 ||_F with the auxiliary model Q'; None where it does not move, or
    neither has a frame.

    Parameters
    ----------
    positions, companion : (F + 1, N, 3) m, the initial ones first
    """
    last = min(len(positions), len(companion), end + 1)
    moved = float(np.linalg.norm(companion[1:last] - companion[0]))
    if moved == 0.0:
        return None
    return float(np.linalg.norm(positions[1:last] - companion[1:last])) / moved


class RunningEstimate:
    """Estimated relative error of a run while it runs.

    Root mean square of || Q_f - Q'_f ||_F over the frames f so far, over that of the displacement
    || Q_f - Q_0 ||_F over the training run. What the run itself has moved so far is no unit: at
    its beginning that is next to nothing, and every run would be wrong.

    Parameters
    ----------
    motion : root mean square displacement of the training run, m
    """

    def __init__(self, motion: float) -> None:
        self._motion = motion
        self._squares = 0.0
        self._frames = 0

    @property
    def value(self) -> float | None:
        """The estimate; None before the first frame."""
        return self._ratio(self._squares, self._frames) if self._frames else None

    def after(self, positions: np.ndarray, companion: np.ndarray) -> float:
        """Estimate after one more frame that ends at ``positions`` and ``companion`` (N, 3) m."""
        return self._ratio(self._squares + _square(positions, companion), self._frames + 1)

    def add(self, positions: np.ndarray, companion: np.ndarray) -> None:
        """Take in one more frame that ends at ``positions`` and ``companion`` (N, 3) m."""
        self._squares += _square(positions, companion)
        self._frames += 1

    def _ratio(self, squares: float, frames: int) -> float:
        return float(np.sqrt(squares / frames)) / self._motion


def _square(positions: np.ndarray, companion: np.ndarray) -> float:
    difference = positions - companion
    return float(np.vdot(difference, difference))


def largest_estimate(
    positions: np.ndarray, companion: np.ndarray, motion: float, end: int
) -> float | None:
    """Largest `RunningEstimate` after any frame before ``end``; None if neither run has a frame.

    Parameters
    ----------
    positions, companion : (F + 1, N, 3) m, the initial ones first
    motion : root mean square displacement of the training run, m
    """
    running, largest = RunningEstimate(motion), None
    for own, other in zip(positions[1 : end + 1], companion[1:], strict=False):
        running.add(own, other)
        value = running.value or 0.0
        largest = value if largest is None else max(largest, value)
    return largest
