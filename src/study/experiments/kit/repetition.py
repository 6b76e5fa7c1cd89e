"""A reduced run repeated: trained on other frames, or from a slightly moved start.

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
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.deviations import error_within
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group, rerun
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.sampling import Reduction, select_path
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
    """One repetition.

    error : before the horizon; inf for a run that ended earlier
    errors : (F,) of each frame before the horizon, relative to the motion of the whole run (root
        mean square over its frames); inf from the frame on at which the run ended
    """

    r: int
    seed: int
    gain: float
    error: float
    finite: bool
    errors: np.ndarray


class Repeater:
    """Repeats runs of a scene with one group reduced, up to the horizon.

    Parameters
    ----------
    reference : (F + 1, N, 3) positions of the full-order run, which errors are taken against
    end : first frame that is not judged
    """

    def __init__(
        self,
        scene: Scene,
        group: str,
        data: SnapshotSet,
        reference: np.ndarray,
        end: int,
        asked: Repetitions,
        blowup_extent: float,
    ) -> None:
        frames = min(scene.config.frames, max(2, end))
        self.scene = Scene.build(scene.config.model_copy(update={"frames": frames}), scene.mesh)
        self.group = self.scene.group(group)
        self.data, self.asked, self.end = data, asked, end
        self.reference = reference[: frames + 1]
        self.blowup_extent = blowup_extent
        displacement = displacement_norms(reference)
        self._displacement = displacement[:frames]
        self._motion = float(np.sqrt(np.mean(displacement**2)))
        self._bases: dict[tuple[str, int | None], Basis] = {}
        self._reductions: dict[tuple[MethodSpec, int | None], dict[int, Reduction]] = {}

    def repeat(
        self, method: MethodSpec, sizes: Sequence[int], varied: Varied
    ) -> Iterator[Repetition]:
        """Every repetition of ``method`` at each of ``sizes`` that its basis has.

        ``varied`` says what the seed draws: the start, or the training snapshots.
        """
        for seed in range(1, self.asked.repetitions + 1):
            subset = None if varied == "start" else seed
            for r, reduction in self._reduced(method, sizes, subset).items():
                yield self._run(reduction, r, seed, moved=varied != "training")

    def _run(self, reduction: Reduction, r: int, seed: int, moved: bool) -> Repetition:
        field = perturbation_field(self.scene, self.asked.perturbation, seed) if moved else None
        steps = replace_group(self.scene, self.group.name, ReducedLocalStep(self.group, reduction))
        outcome = rerun(
            self.scene,
            self.scene.system,
            steps,
            reference=self.reference,
            blowup_extent=self.blowup_extent,
            offset=field,
        )
        error = error_within(outcome.difference, self._displacement, self.end)
        errors = np.full(len(self._displacement), np.inf)
        errors[: outcome.frames] = outcome.difference / self._motion
        return Repetition(
            r=r,
            seed=seed,
            gain=reduction.gain,
            error=float("inf") if error is None else error,
            finite=outcome.finite,
            errors=errors,
        )

    def _reduced(
        self, method: MethodSpec, sizes: Sequence[int], subset: int | None
    ) -> dict[int, Reduction]:
        if (method, subset) not in self._reductions:
            self._reductions = {(method, subset): self._reduce(method, sizes, subset)}
        return self._reductions[method, subset]

    def _reduce(
        self, method: MethodSpec, sizes: Sequence[int], subset: int | None
    ) -> dict[int, Reduction]:
        key = (method.basis_id, subset)
        if key not in self._bases:
            data = self.data
            train = data.train if subset is None else drawn(data, subset)
            self._bases[key] = compute_basis(
                train,
                data.row_mass,
                data.roundoff,
                rows_per_element=data.rows_per_element,
                spec=method,
            )
        basis = self._bases[key]
        held = [r for r in sizes if r <= basis.rank]
        path = select_path(basis, method, held) if held else {}
        return {r: Reduction(basis, path[r], method, r=r) for r in held}


def drawn(data: SnapshotSet, seed: int) -> np.ndarray:
    """Snapshots (n, e p, 3), as many as train in ``data``, drawn by ``seed`` from all, in order."""
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    chosen = np.random.default_rng(seed).choice(len(frames), len(data.train), replace=False)
    chosen = chosen[np.argsort(frames[chosen])]
    count = len(data.train)
    return np.stack([data.train[i] if i < count else data.test[i - count] for i in chosen])
