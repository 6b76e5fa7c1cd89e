"""Runs that are asked for an error, on motions that no choice has seen.

Everything is made here: the hierarchy of a scene from its training motion, its scores on a further
motion of one's own making, and then the asks on the held-out motions. Which factor multiplies the
estimates of a scene is decided by the scores of the other scenes, in the table: runs are made for
every factor of a grid.
"""

import logging
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from pdrom.artifact.reads import Setting, SourcesOf
from pdrom.core.paths import ASK_SCORES, ASKS, File
from pdrom.core.store import write_table
from pdrom.experiments.kit.declaration import experiment
from pdrom.experiments.kit.settings import Tolerance
from pdrom.model.held_out import FIRST, MOTIONS, HeldOutMotion
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.hierarchy import JUDGED, AskSettings, Hierarchy, hierarchy
from pdrom.reduction.asked.level import Level
from pdrom.reduction.asked.loops import Remembered
from pdrom.reduction.asked.measured import Motion, Tried, tried
from pdrom.reduction.asked.motions import CALIBRATION
from pdrom.reduction.asked.run import Asked, CheckedRun

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "motion", "asked", "factor", "vertices", "frames", "judged", "promised", "error",
    "velocity_error", "expected", "estimate", "first_step", "last_step", "reduced_frames", "checks",
    "repairs", "ms_per_frame", "full_step", "full_error", "full_ms", "own_ms", "oracle_step",
    "oracle_ms",
]  # fmt: skip
REPEATS = 2  # runs of an ask, for the time
SCORE_COLUMNS = ["scene", "asked", "factor", "step", "error"]
Factor = Annotated[float, Field(ge=1.0, le=100.0)]


class AskedErrors(AskSettings):
    """Every ask of ``errors``, run on each of ``motions`` with every one of ``factors``."""

    errors: tuple[Tolerance, ...] = (0.1, 0.03, 0.01)
    motions: Annotated[tuple[HeldOutMotion, ...], Field(min_length=1)] = MOTIONS
    factors: Annotated[tuple[Factor, ...], Field(min_length=1)] = (4.0, 5.0, 6.0)


class Asks(AskedErrors):
    """Section ``asks``: what is asked of each of ``scenes`` (all if empty, the large ones too).

    Of the factors the table takes, for each scene, the one that the other scenes give for a
    ``risk``: the share of promises that a new scene breaks, as it is to be expected.
    """

    scenes: tuple[str, ...] = ()
    risk: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.1


@experiment(
    "Asked errors of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "section": Setting("asks"),
    },
    writes={"out": ASKS, "scores": ASK_SCORES},
)
def asks(
    sources: list[Path], config: SceneConfig, section: AskedErrors, out: File, scores: File
) -> None:
    """Make the hierarchy of a scene, its scores, and every ask on every held-out motion.

    Parameters
    ----------
    sources : files of the mesh; the job depends on them
    config : of the scene
    section : errors and factors that are tried, and the levels
    out, scores : tables of the asks, and of the steps chosen for them on the further motion
    """
    training = Scene.build(config, config.mesh.build(Path()))
    own, _ = hierarchy(training, section)
    found = list(_scores(own, Motion(CALIBRATION.of(training)), section))
    write_table(pd.DataFrame(found, columns=SCORE_COLUMNS), scores.path)
    rows: list[dict[str, Any]] = []
    for name in section.motions:
        variant = Scene.build(config.heldout_variant(name), training.mesh, masses=training.masses)
        rows += _asked(variant, name, own, section)
        log.info("%s: %s done", config.name, name)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _scores(own: Hierarchy, further: Motion, section: AskedErrors) -> Iterator[dict[str, Any]]:
    """Errors on a motion that is not part of the choice of the steps chosen for every ask.

    Steps and errors are missing where no promise is made.
    """
    scene, reached = own.training.config.name, dict[str, float]()
    for asked, factor in product(section.errors, section.factors):
        step = next(iter(own.admissible(Ask(error=asked), factor)), None)
        if step and step.level.title not in reached:
            reached[step.level.title] = tried(step.level, further).errors["position"]
        title = step.level.title if step else None
        cells = (scene, asked, factor, title, reached[title] if title else None)
        yield dict(zip(SCORE_COLUMNS, cells, strict=True))


def _asked(
    scene: Scene, name: str, own: Hierarchy, section: AskedErrors
) -> Iterator[dict[str, Any]]:
    motion = Motion(scene)
    motion.end = min(motion.end, own.horizon)
    loops = Remembered(scene)
    # every step on one motion, for the best choice with hindsight
    steps = own.steps if name == FIRST else []
    every = {s.level.title: tried(s.level, motion, loops) for s in steps}
    plain = tried(Level(scene.config.iterations), motion, loops)
    known: dict[str, Tried] = {}
    for error in section.errors:
        good = {title: t.ms for title, t in every.items() if t.errors["position"] <= error}
        oracle = min(good, key=lambda title: good[title], default=None)
        for factor in section.factors:
            settings = section.model_copy(update={"factor": factor})
            run = CheckedRun(scene, own, Ask(error=error), settings, loops)
            full = run.full_order
            if full.title not in known:
                known[full.title] = every.get(full.title) or tried(full, motion, loops)
            yield {
                "scene": scene.config.name,
                "motion": name,
                "asked": error,
                "factor": factor,
                "vertices": scene.mesh.vertices,
                "frames": motion.end,
                "judged": motion.end >= JUDGED * scene.config.frames,
                **_reached([run.outcome() for _ in range(REPEATS)], motion),
                "full_step": full.title,
                "full_error": known[full.title].errors["position"],
                "full_ms": known[full.title].ms,
                "own_ms": plain.ms,
                "oracle_step": oracle,
                "oracle_ms": good.get(oracle) if oracle else None,
            }


def _reached(outcomes: list[Asked], motion: Motion) -> dict[str, Any]:
    """Cells of a run, whose repetitions differ in nothing but their time; the shortest counts."""
    outcome, seconds = outcomes[0], min(each.seconds for each in outcomes)
    return {
        "promised": outcome.promised,
        "error": motion.error(outcome.positions, "position"),
        "velocity_error": motion.error(outcome.positions, "velocity"),
        "expected": outcome.expected,
        "estimate": outcome.estimate,
        "first_step": outcome.changes[0][1],
        "last_step": outcome.changes[-1][1],
        "reduced_frames": outcome.reduced,
        "checks": len(outcome.checks),
        "repairs": outcome.repairs,
        "ms_per_frame": 1e3 * seconds / (len(outcome.positions) - 1),
    }
