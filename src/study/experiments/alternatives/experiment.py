"""Error and time of every method on one scene, against two references.

One is the implicit step of the scene, solved to convergence: what more iterations approach. The
other is the motion in continuous time, which the implicit step itself misses: what a user wants.
All run the held-out motions; only the reduction has a training motion.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.held_out import FIRST
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.paths import ALTERNATIVE_TIMES, ALTERNATIVES, File
from study.artifact.reads import Settings, SourcesOf
from study.experiments.alternatives.candidates import Trained, candidates, trained
from study.experiments.alternatives.settings import CONVERGED, SETTING, Comparison
from study.experiments.alternatives.solvers.explicit import continuous
from study.experiments.kit.converged import converged_run
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import Case, Variant, in_processes
from study.experiments.kit.reruns import run_error
from study.experiments.kit.settings import BlowupExtent

TIME_COLUMNS = ["scene", "factor", "stiffness", *SETTING, "process", "ms_per_frame"]
log = logging.getLogger(__name__)
COLUMNS = [
    "scene", "factor", "vertices", "stiffness", "method", "substeps", "iterations", "trained_on",
    "k", "elements_sampled", "motion", "frames", "finite", "error_implicit", "error_continuous",
    "reference_error",
]  # fmt: skip


@dataclass(frozen=True)
class Timed(Case):
    """A scene in the motion that is timed, its labels, and the reductions of it."""

    labels: dict[str, object]
    scene: Scene
    models: tuple[Trained, ...]
    settings: Comparison

    def variants(self) -> Iterator[Variant]:
        """Loops of all candidates; ``steps`` of one are a frame."""
        for each in candidates(self.scene, self.models, self.settings):
            labels = {**self.labels, **each.labels, "steps": each.steps}
            yield Variant(labels, each.loop, each.start, each.steps * self.settings.frames)


class Options(ConfigModel):
    """Settings of the comparison on a mesh size."""

    scene: SceneConfig
    alternatives: Comparison
    blowup_extent: BlowupExtent


@experiment(
    "Alternatives to projective dynamics in {scene} with {factor} times the vertices along a side",
    reads={"sources": SourcesOf("scene.mesh"), "settings": Settings(Options)},
    writes={"out": ALTERNATIVES, "times": ALTERNATIVE_TIMES},
    alone=True,
)
def alternatives(sources: list[Path], settings: Options, out: File, times: File) -> None:
    """Compare all methods on one mesh: ``factor`` times the vertices along each side.

    Parameters
    ----------
    sources : files of the mesh; the job depends on them
    settings : scene, methods and limits
    out, times : tables of the errors and of the times, with the factor among their labels
    """
    factor, section = float(out["factor"]), settings.alternatives
    rows, cases = [], []
    for stiffness in section.factors(settings.scene.name, factor):
        config = sized(settings.scene, factor, stiffness)
        config = config.model_copy(update={"frames": min(section.compared, config.frames)})
        training = Scene.build(config, config.mesh.build(Path()))
        models = tuple(trained(training, section))
        own = {"scene": config.name, "factor": factor, "stiffness": stiffness}
        for motion in section.motions:
            scene = Scene.build(config.heldout_variant(motion), training.mesh)
            for row in _rows(scene, models, settings):
                rows.append({**own, "motion": motion, **row})
            if motion == FIRST:
                cases.append(Timed(own, scene, models, section))
        log.info("%s: stiffness %g done", settings.scene.name, stiffness)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
    measured = pd.DataFrame(in_processes(cases, section))
    measured["ms_per_frame"] *= measured.steps
    write_table(measured.reindex(columns=TIME_COLUMNS), times.path)


def sized(config: SceneConfig, factor: float, stiffness: float) -> SceneConfig:
    """``config`` on a mesh ``factor`` times finer, of equal mass, weights times ``stiffness``."""
    finer = config.coarsened(factor, 1.0)
    counts = [c.mesh.build(Path()).vertices for c in (config, finer)]
    effects = tuple(
        e.model_copy(update={"weight": stiffness * e.weight}) if isinstance(e, GroupConfig) else e
        for e in finer.effects
    )
    mass = config.vertex_mass * counts[0] / counts[1]
    return finer.model_copy(update={"vertex_mass": mass, "effects": effects})


def _rows(scene: Scene, models: tuple[Trained, ...], settings: Options) -> Iterator[dict[str, Any]]:
    """Errors of every candidate in the motion of ``scene``, those of the reference first.

    There is none against the implicit step where a frame of it did not converge, or where it would
    cost too much, and none of a run that blew up.
    """
    section, name, vertices = settings.alternatives, scene.config.name, scene.mesh.vertices
    frames, wanted, implicit = scene.config.frames, section.continuous, None
    limit = wanted.limit // vertices
    exact = continuous(scene, frames, wanted.tolerance, substeps=wanted.substeps, limit=limit)
    log.info("%s: %d explicit steps a frame, error %.1e", name, exact.substeps, exact.error)
    if not exact.error <= wanted.tolerance:
        log.warning("%s: motion in continuous time is known to %.1e only", name, exact.error)
    if section.affords(CONVERGED, vertices):
        implicit = converged_run(scene, section.implicit.tolerance, section.implicit.limit)
        if implicit is None:
            log.warning("%s: no convergence in %d evaluations", name, section.implicit.limit)
    against = {"error_implicit": implicit, "error_continuous": exact.positions}

    def errors(run: np.ndarray | None) -> dict[str, float | None]:
        return {
            key: None if run is None or other is None else run_error(run, other)
            for key, other in against.items()
        }

    common = {"vertices": vertices, "frames": frames, "reference_error": exact.error}
    yield {**common, "method": CONVERGED, "substeps": 1, "finite": True, **errors(implicit)}
    for candidate in candidates(scene, models, section):
        with np.errstate(over="ignore", invalid="ignore"):
            reached = candidate.run(frames, settings.blowup_extent, scene.mesh.extent)
        yield {**common, **candidate.labels, "finite": reached is not None, **errors(reached)}
