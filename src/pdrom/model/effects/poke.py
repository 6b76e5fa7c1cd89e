"""A boundary condition that moves single vertices back and forth, one after the other."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from pdrom.core.errors import SceneError
from pdrom.model.effects.base import Boundary, EffectConfig, FrameNumber
from pdrom.model.effects.hold import AXES
from pdrom.model.mesh.selection import Selection, farthest_points, select_vertices
from pdrom.model.mesh.types import Length, Mesh

# displacements, divided by the amplitude, at equally spaced times
KNOTS = (0.0, -1.0, 1.0, -1.0, 0.0)


class Poke(Boundary):
    """Move vertices in turn by 0 -> -a -> a -> -a -> 0 on an axis (amplitude a), then free them.

    Vertices outside ``avoid`` are chosen by farthest-point sampling from the centre. The reproduced
    preprint gives no speeds, so that amplitude, frames and order are choices of this study.
    """

    class Config(EffectConfig):
        """``amplitude``, m; each vertex moves for ``over`` frames, then no vertex for ``rest``."""

        effect: Literal["poke"] = "poke"
        amplitude: Length = 0.2
        axis: Literal["x", "y", "z"] = "z"
        over: Annotated[FrameNumber, Field(ge=1)] = 20
        rest: FrameNumber = 10
        count: Annotated[int, Field(ge=1, le=1000)] = 8
        avoid: tuple[Selection, ...] = ()

        def redirected(self, axes: Sequence[int]) -> Self:
            return self.model_copy(update={"amplitude": -self.amplitude})

    moves = True

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        avoided = [select_vertices(mesh, selection) for selection in config.avoid]
        free = np.setdiff1d(np.arange(mesh.vertices), np.concatenate([[], *avoided]).astype(int))
        if len(free) < config.count:
            raise SceneError(
                f"poke: count = {config.count}, but only {len(free)} vertices are not in avoid"
            )
        self._order = farthest_points(mesh.points, free, config.count)
        self.vertices = np.sort(self._order)

    def active(self, frame: int) -> bool:
        turn, phase = divmod(frame, self.config.over + self.config.rest)
        return turn < self.config.count and phase < self.config.over

    def held(self, frame: int) -> np.ndarray:
        turn = frame // (self.config.over + self.config.rest)
        return self._order[turn : turn + 1]

    def takes_hold(self, frame: int) -> bool:
        return frame % (self.config.over + self.config.rest) == 0

    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        phase = frame % (self.config.over + self.config.rest)
        times, target = np.linspace(0.0, 1.0, len(KNOTS)), anchor.copy()
        knot = np.interp((phase + 1) / self.config.over, times, KNOTS)
        target[:, AXES[self.config.axis]] += self.config.amplitude * knot
        return target

    def units(self) -> list[np.ndarray]:
        return [np.array([vertex]) for vertex in self._order]
