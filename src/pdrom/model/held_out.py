"""Variants of a scene with other trajectories, for tests or for training of a reduced model.

The three test trajectories of a scene differ from its training trajectory by a rule that is the
same for all scenes. The rule was chosen by one number only: the error of replaying the training
trajectory instead of simulating. No run of a reduced model influenced the choice.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects.base import EffectConfig, Seed, effect_config
from pdrom.model.mesh.types import Length

HeldOutMotion = Literal["heldout", "kick", "stiffness"]
MOTIONS: tuple[HeldOutMotion, ...] = get_args(HeldOutMotion)
FIRST = MOTIONS[0]
PLAYBACK = "playback"  # method in tables: replaying the training trajectory instead of simulating
FASTER = 0.75  # duration of handle motions in "kick", relative to the training trajectory
# Test -> degrees by which gravity turns towards an axis, and index of the axis in ``kick_axes``.
TILTS = {"heldout": (-20.0, 0), "kick": (30.0, 0), "stiffness": (20.0, -1)}
# Test -> sign of the pins' displacement along an axis, and index of the axis in ``kick_axes``.
CARRIED = {"heldout": (1.0, 0), "stiffness": (-1.0, -1)}
CARRY_S = 0.5  # duration of the pins' displacement, s
FURTHER = 20261125  # first of the three numbers that seed a trajectory of `HeldOut.further`


class HeldOut(ConfigModel):
    """Settings of the test trajectories of a scene; changes are along the axes ``kick_axes``.

    Test "heldout" multiplies frame numbers of effects by ``frames_factor``, moves pins by ``carry``
    (m) and turns gravity. Test "kick" adds a random initial velocity of ``kick`` (m/s, by
    ``seed``), makes handles faster (`FASTER`) and turns gravity further in the opposite direction.
    Test "stiffness" multiplies the weights of all constraints by ``stiffness``, moves handles and
    pins in other directions, turns gravity towards another axis and adds an initial velocity by
    another seed. Changes of gravity, handles or pins do not apply to scenes without them.
    """

    frames_factor: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.25
    carry: Length = 0.5
    kick: Annotated[float, Field(ge=0.0, le=1e3)] = 2.0
    kick_axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1)] = ("x", "y", "z")
    seed: Seed = 1
    stiffness: Annotated[float, Field(ge=1e-3, le=1e3)] = 0.25

    def variant(
        self, effects: Sequence[EffectConfig], motion: HeldOutMotion, time_step: float
    ) -> tuple[EffectConfig, ...]:
        """Return the effects of a test trajectory; ``effects`` are those of the training."""
        own = [self._changed(effect, motion, time_step) for effect in effects]
        if motion != FIRST and self.kick:
            seed = (self.seed + MOTIONS.index(motion)) % 2**63
            kick = {"effect": "kick", "speed": self.kick, "seed": seed, "axes": self.kick_axes}
            own.append(effect_config(kick, len(own)))
        return tuple(own)

    def further(
        self, effects: Sequence[EffectConfig], seed: int, time_step: float
    ) -> tuple[EffectConfig, ...]:
        """Return the effects of a further training trajectory, random with this ``seed``.

        The initial velocity is 0.5 to 2 times ``kick``, gravity is turned by up to 45 degrees,
        frame numbers of effects are multiplied by 0.7 to 1.4, weights of the constraints by 0.4 to
        2.7, and pins move by up to ``carry``. These trajectories are never used for tests.
        """
        rng = np.random.default_rng([FURTHER, self.seed, seed])
        axes = ["xyz".index(axis) for axis in self.kick_axes]
        degrees, duration = rng.uniform(-45.0, 45.0), rng.uniform(0.7, 1.4)
        weight, speed = np.exp(rng.uniform(-1.0, 1.0)), self.kick * rng.uniform(0.5, 2.0)
        place, offset = int(rng.integers(len(axes))), np.zeros(3)
        offset[axes] = self.carry * rng.uniform(-1.0, 1.0, len(axes))
        own = []
        for effect in effects:
            changed = effect.with_frames_scaled(duration)
            if isinstance(effect, GroupConfig):
                changed = effect.model_copy(update={"weight": float(weight) * effect.weight})
            changed = changed.tilted(degrees, axes, place if place < len(axes) - 1 else -1)
            over = max(1, round(CARRY_S / time_step))
            own.append(changed.carried(offset.tolist(), over) if self.carry else changed)
        if self.kick:
            kick = {"effect": "kick", "speed": speed, "seed": int(rng.integers(2**31))}
            own.append(effect_config(kick | {"axes": self.kick_axes}, len(own)))
        return tuple(own)

    def _changed(
        self, effect: EffectConfig, motion: HeldOutMotion, time_step: float
    ) -> EffectConfig:
        axes = ["xyz".index(axis) for axis in self.kick_axes]
        redirected = effect.redirected(axes)
        if motion == FIRST:
            effect = effect.with_frames_scaled(self.frames_factor)
        elif motion == "stiffness":
            effect = redirected
            if isinstance(effect, GroupConfig):
                return effect.model_copy(update={"weight": self.stiffness * effect.weight})
        elif redirected != effect:  # only handles (effects that move vertices) change
            effect = effect.with_frames_scaled(FASTER)
        degrees, place = TILTS[motion]
        effect = effect.tilted(degrees, axes, place)
        if motion in CARRIED and self.carry:
            sign, place = CARRIED[motion]
            offset = [0.0, 0.0, 0.0]
            offset[axes[place]] = sign * self.carry
            effect = effect.carried(offset, max(1, round(CARRY_S / time_step)))
        return effect
