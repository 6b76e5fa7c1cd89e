"""Cost of a guard at run time, by its alarm, and the gain of falling back."""

import logging
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.energy import EnergyScale
from pdrom.model.runs.bounded import Advance, BoundedRun, frame_by_frame
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.local.guard_settings import Action, AlarmName, GuardSettings
from pdrom.reduction.local.guarded import Trained, guarded, guarded_rerun
from pdrom.reduction.local.ranks import Rank, resolve_ranks
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import displacement_norms
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.subspace.store import load_models
from study.artifact.paths import BASIS, COMPANION, GUARD, MESH, SAMPLING, TRAIN, File
from study.artifact.reads import EachOf, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.load_reduction import load_reduction
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Solver

log = logging.getLogger(__name__)

# Actions and alarms that are compared.
WATCHES: tuple[tuple[Action, AlarmName], ...] = (
    ("none", "trained-range"),
    ("report", "trained-range"),
    ("fall-back", "trained-range"),
    ("report", "estimate"),
    ("fall-back", "estimate"),
)
COLUMNS = [
    "scene", "group", "method", "r", "action", "alarm", "threshold", "frames", "finite",
    "blowup_frame", "relative_error", "energy_ratio", "guard_frame", "guard_reason", "guard_count",
    "guard_estimate", "fallback_frames", "fallback_share", "ms_per_frame", "relative_cost",
]  # fmt: skip


class TriedGuard(GuardSettings):
    """A guard whose actions and alarms are compared, each timed ``repeats`` times."""

    repeats: Annotated[int, Field(ge=1)] = 3


class GuardCase(ConfigModel):
    """A reduction on which the guard is tried, if the study holds scene, method and size."""

    scene: str
    method: str
    r: Rank


class GuardSection(TriedGuard):
    """Section ``guard``: the guard of the reruns, and the ``cases`` that compare guards."""

    cases: tuple[GuardCase, ...] = ()


class Trial(ConfigModel):
    """A case with everything that it depends on; ``name`` is that of the method."""

    scene: SceneConfig
    group: str
    name: str
    method: MethodSpec
    r: Rank

    @property
    def labels(self) -> dict[str, str]:
        """Labels of the files of this case."""
        return {"scene": self.scene.name, "group": self.group, "method": self.name}


class Options(ConfigModel):
    """Settings of the trials of the guard."""

    trials: tuple[Trial, ...]
    guard: TriedGuard
    blowup_extent: BlowupExtent
    solver: Solver


@experiment(
    "Guard at run time: what falling back buys",
    reads={
        "meshes": EachOf(MESH, "trials"),
        "runs": EachOf(TRAIN, "trials"),
        "bases": EachOf(BASIS, "trials"),
        "samplings": EachOf(SAMPLING, "trials"),
        "companions": EachOf(COMPANION, "trials"),
        "settings": Settings(Options),
    },
    writes={"out": GUARD},
    alone=True,
)
def guard(
    meshes: list[File],
    runs: list[File],
    bases: list[File],
    samplings: list[File],
    companions: list[File],
    settings: Options,
    out: File,
) -> None:
    """Run every trial without a guard, watched, and with fall-back, and time all of them.

    Parameters
    ----------
    meshes, runs, bases, samplings, companions : files of each trial, in the order of the trials
    """
    rows = []
    files = zip(meshes, runs, bases, samplings, companions, strict=True)
    for case, paths in zip(settings.trials, files, strict=True):
        trial = _Trial(case, settings, *paths)
        seconds = trial.seconds(settings.guard.repeats)
        rows += [
            {**row, "ms_per_frame": 1e3 * seconds[i], "relative_cost": seconds[i] / seconds[0]}
            for i, row in enumerate(trial.rows())
        ]
        log.info("%s, %s", case.scene.name, case.name)
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = ["r", "blowup_frame", "guard_frame", "guard_count", "fallback_frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), out.path)


class _Trial:
    """One failing reduction."""

    def __init__(
        self,
        case: Trial,
        settings: Options,
        mesh: File,
        run: File,
        basis: File,
        sampling: File,
        companion: File,
    ) -> None:
        self.case = case
        self.limit = settings.blowup_extent
        self.scene: Scene = scene_of(case.scene, mesh)
        self.system: GlobalSystem = self.scene.system_with(settings.solver)
        self.settings: list[GuardSettings] = [
            settings.guard.model_copy(update={"action": action, "alarm": alarm})
            for action, alarm in WATCHES
        ]
        self.reference = positions_of(run)
        ((_, model),) = load_models(companion.path)
        self.trained = Trained.on(self.reference, model)
        space = load_basis(basis.path)
        r = min(resolve_ranks([case.r], space.rank)[0], space.rank)
        self.reduction: Reduction = load_reduction(space, sampling.path, case.method, r=r)

    def rows(self) -> list[dict[str, Any]]:
        """The full-order run, then the reduced ones."""
        name = self.scene.config.name
        full: dict[str, Any] = {
            "scene": name,
            "group": self.case.group,
            "method": "full",
            "action": "none",
        }
        frames = self.scene.config.frames
        full |= {"frames": frames, "finite": True, "relative_error": 0.0, "energy_ratio": 1.0}
        return [full, *(self._row(settings) for settings in self.settings)]

    def _row(self, settings: GuardSettings) -> dict[str, Any]:
        outcome, seen = guarded_rerun(
            self.scene, self.system, self.case.group, reduction=self.reduction,
            reference=self.reference, blowup_extent=self.limit,
            settings=settings, trained=self.trained,
        )  # fmt: skip
        estimated = seen.watched and settings.alarm == "estimate"
        share = seen.fallback_frames / outcome.frames if seen.watched else None
        return {
            "scene": self.scene.config.name,
            "group": self.case.group,
            "method": self.case.name,
            "r": self.reduction.r,
            "action": settings.action,
            "alarm": settings.alarm if seen.watched else None,
            "threshold": settings.threshold if estimated else None,
            "frames": outcome.frames,
            "finite": outcome.finite,
            "blowup_frame": outcome.blowup_frame,
            "relative_error": outcome.error(displacement_norms(self.reference)),
            "energy_ratio": EnergyScale.of(self.scene, self.reference).ratio(outcome.positions),
            **seen.columns(),
            "fallback_share": share,
        }

    def seconds(self, repeats: int) -> list[float]:
        """Median seconds per frame of the rows, measured in turns after one unmeasured turn."""
        makers = [self._full_order, *(lambda s=s: self._guarded(s) for s in self.settings)]
        samples = [[_time(make(), self.scene) for make in makers] for _ in range(repeats + 1)]
        return np.median(samples[1:], axis=0).tolist()

    def _full_order(self) -> Advance:
        return self.scene.stepper(self.system, self.scene.groups, track_objective=False).step

    def _guarded(self, settings: GuardSettings) -> Advance:
        loop, _ = guarded(
            self.scene,
            self.system,
            self.case.group,
            reduction=self.reduction,
            settings=settings,
            trained=self.trained,
        )
        return loop.step


def _time(advance: Advance, scene: Scene) -> float:
    """Seconds per frame of a run, which ends where it is no longer finite."""
    run = BoundedRun(frame_by_frame(advance), scene.initial_state(), scene.config.frames)
    started = perf_counter()
    frames = sum(1 for _ in run)
    return (perf_counter() - started) / max(1, frames)
