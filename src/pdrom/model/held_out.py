"""Held-out trajectories of a scene: what differs from the training one."""

from collections.abc import Sequence
from typing import Annotated, Literal, get_args

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects.base import EffectConfig, Seed, effect_config

HeldOutMotion = Literal["heldout", "kick", "stiffness", "speed", "gravity", "kick_stiffness"]
WIDE_MOTIONS: tuple[HeldOutMotion, ...] = get_args(HeldOutMotion)
MOTIONS = WIDE_MOTIONS[:3]  # the study's verdicts rest on these
FIRST = MOTIONS[0]
KICK = 0.5  # m/s, where a scene declares none
FASTER = 0.8  # share of its frames that a handle has left in `speed`
TILT = 15.0  # degrees, of `gravity`


class HeldOut(ConfigModel):
    """Other motions of the same scene, by one rule for all scenes.

    ``heldout`` stretches every handle and schedule in time by ``frames_factor`` (another speed),
    turns the handles' direction round (``reverse``) and adds an initial velocity ``kick`` (m/s,
    seeded). The others change one thing of the training motion: ``kick`` adds such a velocity with
    the next seed, ``stiffness`` multiplies the weights of all groups, ``speed`` makes handles and
    schedules faster (`FASTER`), ``gravity`` turns it (`TILT`) towards the axis of ``kick_axes``
    that it points along least; ``kick_stiffness`` changes both. Where there is nothing to change,
    a velocity twice as fast as in ``kick``, with a seed of its own, takes the place.
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
        if motion == FIRST:
            own = [effect.with_frames_scaled(self.frames_factor) for effect in effects]
            if self.reverse:
                own = [effect.reversed() for effect in own]
            if self.kick:
                own.append(self._kick(self.kick, 0, len(own)))
            return tuple(own)
        if motion == "kick_stiffness":
            return self.variant(self.variant(effects, "stiffness"), "kick")
        place, speed = WIDE_MOTIONS.index(motion), self.kick or KICK
        if motion == "kick":
            return (*effects, self._kick(speed, place, len(effects)))
        changed = tuple(self._changed(effect, motion) for effect in effects)
        if changed != tuple(effects):
            return changed
        return (*effects, self._kick(2.0 * speed, place, len(effects)))

    def _kick(self, speed: float, shift: int, place: int) -> EffectConfig:
        seed = (self.seed + shift) % 2**63
        kick = {"effect": "kick", "speed": speed, "seed": seed, "axes": self.kick_axes}
        return effect_config(kick, place)

    def _changed(self, effect: EffectConfig, motion: HeldOutMotion) -> EffectConfig:
        if motion == "speed":
            return effect.with_frames_scaled(FASTER)
        if motion == "gravity":
            return effect.tilted(TILT, ["xyz".index(axis) for axis in self.kick_axes])
        if isinstance(effect, GroupConfig):
            return effect.model_copy(update={"weight": self.stiffness * effect.weight})
        return effect
