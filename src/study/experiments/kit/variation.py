"""A scene at another time step and with other stiffness, all else in physical units the same."""

from collections.abc import Sequence

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.scene import SceneConfig


def varied(
    config: SceneConfig,
    time_step: float,
    stiffness_ratio: float,
    duration: float,
    frames: Sequence[int],
) -> SceneConfig:
    """``config`` with ``time_step`` (s) and the reduced groups' weights times ``stiffness_ratio``.

    Schedules keep their times in seconds, so that their frame numbers change. The run takes
    ``duration`` seconds, but at least ``frames[0]`` and at most ``frames[1]`` frames. The other
    groups keep their weights.
    """
    count = min(max(round(duration / time_step), frames[0]), frames[1])
    effects = []
    for effect in config.effects:
        effect = effect.with_frames_scaled(config.time_step / time_step)
        if isinstance(effect, GroupConfig) and effect.effect in config.reduce:
            effect = effect.model_copy(update={"weight": stiffness_ratio * effect.weight})
        effects.append(effect)
    # the experiments, with their numbers of training snapshots, belong to the original run
    changes = {"time_step": time_step, "frames": count, "effects": tuple(effects)}
    return config.model_copy(update=changes)
