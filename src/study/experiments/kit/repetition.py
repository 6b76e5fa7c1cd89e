"""Runs of a scene with one group reduced: from moved starts, on other training frames or signs.

A run is one draw of what nobody means to choose: which frames train, and the last digits of the
start. Where an error of the run decides something, its repetitions say how much of it is that.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, basis_of
from pdrom.reduction.deviations import error_within
from pdrom.reduction.local.rerun import rerun_reduced
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.snapshots import SnapshotSet
from study.experiments.kit.sensitivity import perturbation_field
from study.experiments.kit.settings import Tolerance

Varied = Literal["start", "training", "both"]


class Repetitions(ConfigModel):
    """Settings of repeated runs.

    repetitions : draws, each with a seed of its own, from 1
    perturbation : length by which a start is moved, over the extent
    """

    repetitions: Annotated[int, Field(ge=1, le=1000)] = 5
    perturbation: Tolerance = 1e-10


@dataclass(frozen=True)
class Repetition:
    """One repeated run; ``error`` up to the horizon, inf for a run that ended earlier."""

    r: int
    seed: int
    gain: float
    error: float
    finite: bool


class ReducedRuns:
    """Runs of a scene with one group reduced, compared with its full-order run.

    Parameters
    ----------
    data : snapshots of the group
    reference : (F + 1, N, 3) m, positions of the full-order run
    end : first frame that is not judged
    blowup_extent : see `pdrom.reduction.local.rerun.rerun`
    """

    def __init__(
        self,
        scene: Scene,
        group: str,
        data: SnapshotSet,
        reference: np.ndarray,
        end: int,
        blowup_extent: float,
    ) -> None:
        self.scene, self.group, self.data = scene, group, data
        self.reference, self.end, self.blowup_extent = reference, end, blowup_extent
        self.displacement = displacement_norms(reference)
        self._bases: dict[tuple[str, int | None, int | None], Basis] = {}

    def until_the_end(self) -> "ReducedRuns":
        """Copy of the runs up to the first frame that is not judged, but of two frames at least."""
        frames = min(self.scene.config.frames, max(2, self.end))
        scene = self.scene.changed(frames=frames)
        reference = self.reference[: frames + 1]
        return ReducedRuns(scene, self.group, self.data, reference, self.end, self.blowup_extent)

    def basis(
        self, method: MethodSpec, frames: int | None = None, signs: int | None = None
    ) -> Basis:
        """Basis for ``method``; seeds may draw training ``frames``, and ``signs`` of the modes."""
        key = (method.basis_id, frames, signs)
        if key not in self._bases:
            train = None if frames is None else drawn(self.data, frames)
            flips = None if signs is None else np.random.default_rng(signs)
            self._bases[key] = basis_of(self.data, method, train, flips)
        return self._bases[key]

    def run(self, reduction: Reduction, offset: np.ndarray | None = None) -> Rerun:
        """Run with ``reduction`` from the scene's start, moved by ``offset`` (N, 3) m."""
        return rerun_reduced(
            self.scene, self.group, reduction, self.reference, self.blowup_extent, offset=offset
        )

    def error(self, outcome: Rerun) -> float | None:
        """Relative error before the end; None for a run that did not get there."""
        return error_within(outcome.difference, self.displacement, self.end)

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied, asked: Repetitions
    ) -> Iterator[Repetition]:
        """Every repetition of ``method`` at each of ``sizes`` that its basis has.

        ``varied`` says what the seed draws: the start, or the training snapshots.
        """
        own = reductions(self.basis(method), method, sizes) if varied == "start" else None
        for seed in range(1, asked.repetitions + 1):
            made = own
            if made is None:
                made = reductions(self.basis(method, frames=seed), method, sizes)
            offset = None
            if varied != "training":
                offset = perturbation_field(self.scene, asked.perturbation, seed)
            for r, reduction in made.items():
                outcome = self.run(reduction, offset)
                error = self.error(outcome)
                yield Repetition(
                    r, seed, reduction.gain, np.inf if error is None else error, outcome.finite
                )


def drawn(data: SnapshotSet, seed: int) -> np.ndarray:
    """Snapshots (n, e p, 3), as many as train in ``data``, drawn by ``seed`` from all, in order."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    chosen = chosen[np.argsort(frames[chosen])]
    count = len(data.train)
    return np.stack([data.train[i] if i < count else data.test[i - count] for i in chosen])
