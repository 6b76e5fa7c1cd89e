"""How the held-out trajectory of a scene differs from the training one."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.effects.base import EffectConfig, Seed
from pdrom.model.effects.entries import effect_config


class HeldOut(ConfigModel):
    """Another motion of the same scene.

    ``frames_factor`` stretches every handle and schedule in time (another speed), ``reverse`` turns
    the handles' direction round, ``kick`` adds an initial velocity (m/s, seeded).
    """

    frames_factor: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.25
    reverse: bool = False
    kick: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0
    kick_axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1)] = ("x", "y", "z")
    seed: Seed = 1

    def variant(self, effects: Sequence[EffectConfig]) -> tuple[EffectConfig, ...]:
        """Effects of the held-out trajectory, made from ``effects``, those of the training one."""
        changed = [effect.with_frames_scaled(self.frames_factor) for effect in effects]
        if self.reverse:
            changed = [effect.reversed() for effect in changed]
        if self.kick:
            kick = {"effect": "kick", "speed": self.kick, "seed": self.seed}
            changed.append(effect_config({**kick, "axes": self.kick_axes}, len(changed)))
        return tuple(changed)
