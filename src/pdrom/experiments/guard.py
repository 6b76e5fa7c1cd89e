"""Rule guard: what the guard costs, and what falling back to full projections buys."""

import logging
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.store import open_hdf5, write_table
from pdrom.experiments.scenes import scene_of
from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.energy import EnergyScale
from pdrom.model.scene import Scene
from pdrom.reduction.basis import load_basis
from pdrom.reduction.local.guard import Guard, largest_extent
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.guarded import guarded_rerun
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.ranks import resolve_ranks
from pdrom.reduction.local.rerun import displacement_norms, replace_group
from pdrom.reduction.local.watched import WatchedLocalStep
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.sampling.load import load_reduction

log = logging.getLogger(__name__)

ACTIONS = ("none", "report", "fall-back")
COLUMNS = [
    "scene", "group", "method", "r", "action", "frames", "finite", "blowup_frame",
    "relative_error", "energy_ratio", "guard_frame", "guard_reason", "guard_count",
    "fallback_frames", "fallback_share", "ms_per_frame", "relative_cost",
]  # fmt: skip
Advance = Callable[[State, int], tuple[State, FrameReport]]


def try_guard(
    cases: list[dict[str, Any]],
    guard: dict[str, Any],
    repeats: int,
    blowup_extent: float,
    solver: str,
    files: list[dict[str, str]],
    output: str,
) -> None:
    """Run every case without a guard, watched, and with fall-back, and write the table guard.

    Parameters
    ----------
    cases : scene (its configuration), group, method (its specification), name and r
    files : mesh, fom, basis and sampling of each case
    """
    settings = GuardSettings.model_validate(guard)
    rows = []
    for case, paths in zip(cases, files, strict=True):
        trial = _Trial(case, paths, settings, blowup_extent, solver)
        seconds = trial.seconds(repeats)
        rows += [
            {**row, "ms_per_frame": 1e3 * seconds[i], "relative_cost": seconds[i] / seconds[0]}
            for i, row in enumerate(trial.rows())
        ]
        log.info("%s, %s", case["scene"]["name"], case["name"])
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = ["r", "blowup_frame", "guard_frame", "guard_count", "fallback_frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), output)


class _Trial:
    """One failing reduction."""

    def __init__(
        self,
        case: dict[str, Any],
        paths: dict[str, str],
        settings: GuardSettings,
        limit: float,
        solver: str,
    ) -> None:
        self.scene: Scene = scene_of(case["scene"], paths["mesh"])
        self.system: GlobalSystem = self.scene.system_with(solver)
        self.group: str = case["group"]
        self.name: str = case["name"]
        self.limit = limit
        self.settings = [settings.model_copy(update={"action": action}) for action in ACTIONS]
        with open_hdf5(paths["fom"]) as file:
            self.reference = file["positions"][...]
        self.trained_extent = largest_extent(self.reference)
        basis = load_basis(paths["basis"])
        r = min(resolve_ranks([case["r"]], basis.rank)[0], basis.rank)
        method = MethodSpec.model_validate(case["method"])
        self.reduction: Reduction = load_reduction(basis, paths["sampling"], method, r)

    def rows(self) -> list[dict[str, Any]]:
        """The full-order run, then the actions."""
        name = self.scene.config.name
        full = {"scene": name, "group": self.group, "method": "full", "action": "none"}
        frames = self.scene.config.frames
        full |= {"frames": frames, "finite": True, "relative_error": 0.0, "energy_ratio": 1.0}
        return [full, *(self._row(settings) for settings in self.settings)]

    def _row(self, settings: GuardSettings) -> dict[str, Any]:
        outcome, seen = guarded_rerun(
            self.scene, self.system, self.group, self.reduction, self.reference, self.limit,
            settings, self.trained_extent,
        )  # fmt: skip
        whole = outcome.blowup_frame is None
        displacement = displacement_norms(self.reference)
        share = seen.fallback_frames / outcome.frames if seen.watched else None
        return {
            "scene": self.scene.config.name,
            "group": self.group,
            "method": self.name,
            "r": self.reduction.r,
            "action": settings.action,
            "frames": outcome.frames,
            "finite": whole,
            "blowup_frame": outcome.blowup_frame,
            "relative_error": trajectory_error(outcome.difference, displacement) if whole else None,
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
        group = self.scene.group(self.group)
        watches = settings.action != "none"
        if watches:
            step = WatchedLocalStep(group, self.reduction, self.scene.config.iterations)
        else:
            step = ReducedLocalStep(group, self.reduction)
        steps = replace_group(self.scene, self.group, step)
        loop = self.scene.stepper(self.system, steps, track_objective=watches)
        if not watches:
            return loop.step
        guard = Guard(settings, [step], self.trained_extent)
        return lambda state, frame: guard.step(loop, state, frame)


def _time(advance: Advance, scene: Scene) -> float:
    """Seconds per frame of a run, which ends where it is no longer finite."""
    state, frames = scene.initial_state(), 0
    started = perf_counter()
    with np.errstate(over="ignore", invalid="ignore"):
        for frame in range(scene.config.frames):
            state, _ = advance(state, frame)
            frames += 1
            if not np.isfinite(state.positions.sum()):
                break
    return (perf_counter() - started) / frames
