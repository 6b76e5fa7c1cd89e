"""Certified frames of runs that no choice has seen, and estimates of their errors from residuals.

Some frames are done by the full order as well, which gives their defects. They are certified from
the residual alone, and from the end of the full order's frame.
"""

from pathlib import Path
from time import thread_time
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.artifact.reads import Setting, SourcesOf
from pdrom.core.paths import CERTIFIED, File
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.kit.declaration import experiment
from pdrom.model.effects.base import TOUCHING
from pdrom.model.held_out import MOTIONS
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.asked.ask import Ask, relative_error
from pdrom.reduction.asked.certificate import ImplicitStep
from pdrom.reduction.asked.chained import chained, growth
from pdrom.reduction.asked.hierarchy import AskSettings, Hierarchy, Step, hierarchy
from pdrom.reduction.asked.level import Level, Running
from pdrom.reduction.asked.measured import PROBED, Motion, exact_beside, tried

COLUMNS = [
    "scene", "motion", "step", "reduced", "frames", "error", "probed", "convex", "certified",
    "slack", "checks_certified", "checks_slack", "held", "growth", "asked", "ratio", "log_chained",
    "cost", "check_cost",
]  # fmt: skip
# Two reductions and a full order.
LEVELS = AskSettings(
    modes=(20, 40), tolerances=(1e-2,), iterations=(10,), plain=(), accelerated=(20,)
)


class Certified(ConfigModel):
    """Section ``certified``: ``scenes``, each with a factor on the vertices along a side."""

    scenes: dict[str, Annotated[float, Field(gt=0.0, le=10.0)]] = Field(default_factory=dict)


@experiment(
    "Certified frames of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "section": Setting("certified"),
    },
    writes={"out": CERTIFIED},
)
def certified(sources: list[Path], config: SceneConfig, section: Certified, out: File) -> None:
    """Make ways to do a frame, and judge their runs of every held-out motion."""
    config = config.coarsened(section.scenes[config.name], 1.0)
    training = Scene.build(config, config.mesh.build(Path()))
    own, (trained, _) = hierarchy(training, LEVELS)
    # not the iterations of references, which are tried where these converge slowly
    steps = [s for s in own.steps if s.level.model or s.level.iterations in LEVELS.accelerated]
    known = [_Run(step.level, trained) for step in steps]
    rows: list[dict[str, Any]] = []
    for name in MOTIONS:
        variant = Scene.build(config.heldout_variant(name), training.mesh, masses=training.masses)
        motion = Motion(variant)
        motion.end = min(motion.end, own.horizon)
        full_ms = tried(Level(config.iterations), motion).ms
        for step, before in zip(steps, known, strict=True):
            run = _Run(step.level, motion)
            labels = {"scene": config.name, "motion": name, "step": step.level.title}
            rows.append(labels | run.cells(step, own, before, full_ms))
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


class _Run:
    """A level's run before the horizon and before anything touches an obstacle.

    states : (F + 1) of all vertices, the initial one first
    steps, residuals : (F,) objectives of the frames, norms of their gradients
    error : relative error of the positions
    """

    def __init__(self, level: Level, motion: Motion) -> None:
        scene, running = motion.scene, level.on(motion.scene)
        first = running.inside(scene.initial_state())
        states = list(map(running.outside, [first, *running.run(first, range(motion.end))]))
        near = TOUCHING * scene.mesh.extent
        count = 0
        for state, q in zip(states[1:], motion.reference[1:], strict=False):
            gaps = [c.gaps(each).min() for c in scene.contacts for each in (state.positions, q)]
            if not np.isfinite(state.positions).all() or min(gaps, default=np.inf) <= near:
                break
            count += 1
        self.level, self.scene, self.states = level, scene, states[: count + 1]
        self.reference = motion.reference[: count + 1]
        positions = np.stack([state.positions for state in self.states])
        self.error = relative_error(positions, self.reference, "position")
        self.steps = [ImplicitStep(scene, before, f) for f, before in enumerate(states[:count])]
        ends = zip(self.steps, positions[1:], strict=True)
        self.residuals = np.array([step.residual(end) for step, end in ends])

    def cells(self, step: Step, own: Hierarchy, trained: "_Run", full_ms: float) -> dict[str, Any]:
        """Cells of a row; next to none of a run that touches something at once."""
        count, reduced = len(self.steps), self.level.model is not None
        known = {"reduced": reduced, "frames": count, "error": self.error}
        if not count:
            return known
        probed = np.unique(np.linspace(0, count - 1, PROBED + 1).round().astype(int)[1:])
        exact = exact_beside(self.level).on(self.scene)
        frames = pd.DataFrame([self._probe(int(frame), exact) for frame in probed])
        # between the probed frames the constants are those of the nearest one
        nearest = np.abs(np.arange(count)[:, None] - probed).argmin(axis=1)
        estimate = chained(self._apart(0), self.residuals, frames.least.to_numpy()[nearest])
        ratio = trained.error * _size(self.residuals) / _size(trained.residuals)
        defect = _size(frames.defect) / own.unit
        return known | {
            "probed": len(probed),
            "convex": (frames.least > 0.0).mean(),
            "certified": frames.bound.notna().mean(),
            "slack": (frames.bound / frames.defect).median(),
            "checks_certified": frames.beside.notna().mean(),
            "checks_slack": (1.0 + frames.beside / frames.defect).median(),
            "held": not (frames.defect > frames.bound + frames.beside.fillna(0.0)).any(),
            "growth": frames.least.map(growth).median(),
            "asked": own.estimated(step, Ask(error=0.1), defect) / self.error,
            "ratio": ratio / self.error,
            "log_chained": np.log10(estimate / self._apart(count)),
            "cost": frames.ms.median() / full_ms,
            "check_cost": frames.check_ms.median() / full_ms,
        }

    def _probe(self, frame: int, exact: Running) -> dict[str, float]:
        """Defect, certificates of both ends of a frame, and their times."""
        step, before, end = self.steps[frame], self.states[frame], self.states[frame + 1].positions
        times = [thread_time()]
        least, bound = step.certify(end)
        times.append(thread_time())
        (check,) = exact.run(before, range(frame, frame + 1))
        _, beside = step.certify(check.positions)
        times.append(thread_time())
        defect = float(np.linalg.norm(end - check.positions))
        found = {"defect": defect, "least": least, "bound": bound, "beside": beside}
        return found | dict(zip(("ms", "check_ms"), 1e3 * np.diff(times), strict=True))

    def _apart(self, frame: int) -> float:
        """Distance to the reference before ``frame``, in the norm of `growth`."""
        scene, state, q = self.scene, self.states[frame], self.reference
        h, v = scene.config.time_step, scene.initial_state().velocities
        if frame:
            v = (q[frame] - q[frame - 1]) / h
        squares = (state.positions - q[frame]) ** 2 + 2.0 * (h * (state.velocities - v)) ** 2
        return float(np.sqrt(np.sum(scene.system.inertia[:, None] * squares)))


def _size(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
