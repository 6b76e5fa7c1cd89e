"""A horizontal floor."""

from typing import Literal

import numpy as np

from pdrom.model.effects.base import Contact, EffectConfig
from pdrom.model.effects.bodies import square
from pdrom.model.mesh.lengths import Length
from pdrom.model.mesh.types import Mesh


class Floor(Contact):
    """Lifts vertices that ended a frame below the floor back onto it.

    The velocity is taken from the corrected positions, so that the impact is inelastic. Acting
    after the iterations, the floor leaves the objective of the local/global loop alone.
    """

    class Config(EffectConfig):
        """``height`` y of the floor in metres."""

        effect: Literal["floor"] = "floor"
        height: Length = 0.0

        def body(self, low: np.ndarray, high: np.ndarray) -> Mesh:
            return square(
                np.array([0.0, self.height, 0.0]), np.array([0.0, 1.0, 0.0]), low, high=high
            )

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.height = config.height

    def gaps(self, points: np.ndarray) -> np.ndarray:
        return points[:, 1] - self.config.height

    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        np.maximum(positions[:, 1], self.config.height, out=positions[:, 1])
