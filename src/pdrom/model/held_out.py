"""How the held-out trajectories of a scene differ from the training one."""

from collections.abc import Sequence
from typing import Annotated, Literal, get_args

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects.base import EffectConfig, Seed
from pdrom.model.effects.entries import effect_config

HeldOutMotion = Literal["heldout", "kick", "stiffness"]
MOTIONS: tuple[HeldOutMotion, ...] = get_args(HeldOutMotion)
FIRST = MOTIONS[0]
KICK = 0.5  # m/s, where a scene declares none


class HeldOut(ConfigModel):
    """Other motions of the same scene, by one rule for all scenes.

    ``heldout`` stretches every handle and schedule in time by ``frames_factor`` (another speed),
    turns the handles' direction round (``reverse``) and adds an initial velocity ``kick`` (m/s,
    seeded). ``kick`` is such a velocity with the next seed and nothing else, ``stiffness`` the
    training motion with the weights of all groups multiplied.
    """

    frames_factor: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.25
    reverse: bool = False
    kick: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0
    kick_axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1)] = ("x", "y", "z")
    seed: Seed = 1
    stiffness: Annotated[float, Field(ge=1e-3, le=1e3)] = 2.0

    def variant(
        self, effects: Sequence[EffectConfig], motion: HeldOutMotion = FIRST
    ) -> tuple[EffectConfig, ...]:
        """Effects of the held-out ``motion``, made from the ``effects`` of the training one."""
        if motion == "kick":
            return (*effects, self._kick(self.kick or KICK, (self.seed + 1) % 2**63, len(effects)))
        if motion == "stiffness":
            return tuple(self._stiffened(effect) for effect in effects)
        changed = [effect.with_frames_scaled(self.frames_factor) for effect in effects]
        if self.reverse:
            changed = [effect.reversed() for effect in changed]
        if self.kick:
            changed.append(self._kick(self.kick, self.seed, len(changed)))
        return tuple(changed)

    def _kick(self, speed: float, seed: int, place: int) -> EffectConfig:
        kick = {"effect": "kick", "speed": speed, "seed": seed, "axes": self.kick_axes}
        return effect_config(kick, place)

    def _stiffened(self, effect: EffectConfig) -> EffectConfig:
        if not isinstance(effect, GroupConfig):
            return effect
        return effect.model_copy(update={"weight": self.stiffness * effect.weight})
