"""Runs that keep to an asked error."""

from time import perf_counter

import numpy as np

from pdrom.api.arguments import require
from pdrom.api.records import AskedRun, FullRun
from pdrom.core.errors import ConfigurationError
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.hierarchy import AskSettings, hierarchy
from pdrom.reduction.asked.run import CheckedRun


def asked_run(full: FullRun, ask: Ask, scene: Scene | None) -> AskedRun:
    """Choose on the motion of ``full`` for ``ask``, then run ``scene`` (that motion without it).

    Raises
    ------
    ConfigurationError
        ``scene`` is none, or has another mesh or other constraint groups.
    """
    if scene is not None:
        _require_alike(full.scene, require(Scene, scene, "scene", source="load_scene makes one"))
    settings, started = AskSettings(), perf_counter()
    own, (training, _) = hierarchy(full.scene, settings)
    run = CheckedRun(scene or full.scene, own, ask, settings)
    offline = perf_counter() - started
    outcome = run.outcome()
    frames = len(outcome.positions) - 1
    ms = np.full(frames, 1e3 * outcome.seconds / frames)
    configs = [s.config.model_copy(update={"asked": None}) for s in (full.scene, run.scene)]
    same = configs[0] == configs[1]
    error = training.error(outcome.positions, ask.quantity) if same else None
    return AskedRun(run.scene, ask, outcome, ms, offline, own.horizon, error)


def _require_alike(trained: Scene, scene: Scene) -> None:
    groups = [[(g.name, g.elements) for g in s.groups] for s in (trained, scene)]
    if not np.array_equal(trained.mesh.points, scene.mesh.points) or groups[0] != groups[1]:
        raise ConfigurationError(
            f"scene '{scene.config.name}': the training run is of another mesh or other constraint "
            f"groups (scene '{trained.config.name}')"
        )
