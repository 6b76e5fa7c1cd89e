"""Repeat runs with one constraint group reduced, each time with other arbitrary choices.

The error of a run depends on the training frames and on the last digits of the initial positions.
Repetitions show how much it varies.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction import snapshots as sets
from pdrom.reduction.basis import Basis, basis_of
from pdrom.reduction.deviations import Yardstick, error_within
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.model import ProjectionModel
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row, run

Varied = Literal["start", "training", "motions"]
MOVED = 1e-10  # displacement of vertices in repetitions, relative to the mesh's longest side
TRAINED_ON = (1, 2, 4, 8)  # numbers of training trajectories of bases that run test trajectories


class Repetitions(ConfigModel):
    """Settings of repeated runs: their number; the seeds 1, 2, ... draw the random choices."""

    repetitions: kit.Repeats = 5


@dataclass(frozen=True)
class ReducedRuns:
    """Runs with one constraint group reduced, compared with the full-order run.

    data : snapshots of the group's projections
    full : the full-order run
    end : first frame that is not compared (predictability horizon)
    """

    group: str
    data: sets.SnapshotSet
    full: Yardstick
    end: int
    _bases: dict[tuple[str | int | None, ...], Basis] = field(default_factory=dict)

    def until_the_end(self) -> "ReducedRuns":
        """Return a copy with at most max(2, `end`) frames of the full-order run."""
        frames = min(self.full.scene.config.frames, max(2, self.end))
        scene = self.full.scene.changed(frames=frames)
        return replace(self, full=Yardstick(scene, self.full.reference[: frames + 1]))

    def basis(
        self, method: MethodSpec, frames: int | None = None, signs: int | None = None,
        motions: int = 1,
    ) -> Basis:  # fmt: skip
        """Return the basis for ``method``, trained on ``motions`` trajectories.

        Of each of n trajectories, every n-th training snapshot is used. The seed ``frames`` draws
        training frames from all snapshots of the group; the seed ``signs`` draws the signs of the
        singular vectors.
        """
        key = (method.basis_id, frames, signs, motions)
        if key not in self._bases:
            train = None if frames is None else drawn(self.data, frames)
            if motions > 1:
                train = np.concatenate([p[::motions] for p in self._trained[:motions]])
            flips = None if signs is None else np.random.default_rng(signs)
            self._bases[key] = basis_of(self.data, method, train, flips)
        return self._bases[key]

    @cached_property
    def _trained(self) -> list[np.ndarray]:
        """Training snapshots of the scene's training trajectory and of random variants of it."""
        config, mesh = self.full.scene.config, self.full.scene.mesh
        frames, found = self.data.frames["train"], [self.data.train]
        for seed in range(1, max(TRAINED_ON)):
            scene = Scene.build(config.training_variant(seed), mesh)
            found.append(sets.recorded(scene, self.group, scene.initial_state())[1][frames])
        return found

    @cached_property
    def _held_out(self) -> list["ReducedRuns"]:
        config, mesh = self.full.scene.config, self.full.scene.mesh
        scenes = [Scene.build(config.heldout_variant(motion), mesh) for motion in MOTIONS]
        return [replace(self, full=Yardstick(scene, trajectory(scene))) for scene in scenes]

    def run(self, reduction: Reduction, offset: np.ndarray | None = None) -> tuple[Row, Rerun]:
        """Run with ``reduction``, start moved by ``offset`` (N, 3) m; return its row and the run.

        ``error`` in the row is measured before frame `end`, and inf if the run stopped earlier.
        """
        labels = {"r": reduction.r, "gain": reduction.gain}
        row, outcome = run(self.full, ProjectionModel(self.group, reduction), labels, offset)
        error = error_within(outcome.difference, self.full.displacement, self.end)
        return row | {"error": np.inf if error is None else error}, outcome

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied, asked: Repetitions
    ) -> list[Row]:
        """Return rows of all repetitions of ``method``, at each of ``sizes`` up to the rank.

        ``varied`` selects the random choice: initial positions ("start") or training snapshots
        ("training").
        """
        rows, offset, start = [], None, varied == "start"
        for seed in range(1, asked.repetitions + 1):
            if start:
                offset = kit.perturbation_field(self.full.scene, MOVED, seed)
            basis = self.basis(method, frames=None if start else seed)
            made = reductions(basis, method, sizes).values()
            rows += [self.run(reduction, offset)[0] | {"seed": seed} for reduction in made]
        return sorted(rows, key=lambda row: row["r"])

    def on_motions(self, method: MethodSpec, sizes: Sequence[int]) -> Iterator[Row]:
        """Yield a row for each number of training trajectories, size r and test trajectory."""
        for count in TRAINED_ON:
            made = reductions(self.basis(method, motions=count), method, sizes)
            for reduction in made.values():
                varied = f"held out, {count} trained"
                for seed, own in enumerate(self._held_out, 1):
                    yield own.run(reduction)[0] | {"seed": seed, "varied": varied}


def drawn(data: sets.SnapshotSet, seed: int) -> np.ndarray:
    """Draw n of all snapshots of ``data``, as many as it has for training; result: (n, e p, 3)."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    return np.concatenate([data.train, data.test])[chosen[np.argsort(frames[chosen])]]
