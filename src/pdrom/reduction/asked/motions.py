"""Motions of one's own making beside the training motion, on which a choice is tried.

None of them is a held-out motion of the study: other seeds, speeds, stiffnesses.
"""

from dataclasses import dataclass

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects.entries import effect_config
from pdrom.model.held_out import KICK
from pdrom.model.scene import Scene


@dataclass(frozen=True)
class Moved:
    """Changes of a motion: handles and schedules slower, a kick, all weights multiplied."""

    slower: float
    kick: float
    seed: int
    stiffness: float

    def of(self, scene: Scene) -> Scene:
        """The motion of ``scene``, changed."""
        own = scene.config.held_out
        effects = [effect.with_frames_scaled(self.slower) for effect in scene.config.effects]
        effects = [
            e.model_copy(update={"weight": self.stiffness * e.weight})
            if isinstance(e, GroupConfig)
            else e
            for e in effects
        ]
        kick = {
            "effect": "kick",
            "speed": self.kick * (own.kick or KICK),
            "seed": self.seed,
            "axes": own.kick_axes,
        }
        effects.append(effect_config(kick, len(effects)))
        config = scene.config.model_copy(update={"effects": tuple(effects)})
        return Scene.build(config, scene.mesh, masses=scene.masses)


# The first is part of every choice; by the second the factor of the estimates is calibrated.
VALIDATION = Moved(slower=0.9, kick=0.8, seed=101, stiffness=1.6)
CALIBRATION = Moved(slower=1.15, kick=1.0, seed=102, stiffness=0.6)
