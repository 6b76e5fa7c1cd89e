"""Boundary conditions on the positions of vertices in some frames: pins, and moving handles."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.model.effects.base import Boundary, EffectConfig, FrameNumber, Vector
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh


class HoldConfig(EffectConfig):
    """Vertices held in the frames ``start`` <= f < ``until`` (None: to the end of the run)."""

    select: Selection
    start: FrameNumber = 0
    until: FrameNumber | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.until is not None and self.until <= self.start:
            raise ValueError(f"until = {self.until} must be greater than start = {self.start}")
        return self


class Hold(Boundary):
    """Base class of pins and handles; their targets depend on the positions when a hold begins."""

    def __init__(self, config: HoldConfig, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.vertices = select_vertices(mesh, config.select)
        self.side = config.select if isinstance(config.select, str) else None

    def active(self, frame: int) -> bool:
        until = self.config.until
        return self.config.start <= frame and (until is None or frame < until)

    def held(self, frame: int) -> np.ndarray:
        return self.vertices

    def takes_hold(self, frame: int) -> bool:
        return frame == self.config.start

    def units(self) -> list[np.ndarray]:
        return [self.vertices]


class Pins(Hold):
    """Vertices that are fixed at their positions at the beginning of the hold."""

    class Config(HoldConfig):
        """Pinned vertices and frames; fields are those of `HoldConfig`."""

        effect: Literal["pins"] = "pins"

        def carried(self, offset: Sequence[float], over: int) -> EffectConfig:
            own = {"select": self.select, "start": self.start, "until": self.until}
            return Translate.Config(**own, offset=tuple(offset), over=over)

    moves = False

    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        return anchor


class HandleConfig(HoldConfig):
    """Handle: vertices move for ``over`` frames from frame ``start`` and are then held in place."""

    over: Annotated[FrameNumber, Field(ge=1)]

    def progress(self, frame: int) -> float:
        """Return the fraction of the motion, 0 to 1, completed at the end of ``frame``."""
        return min(1.0, (frame + 1 - self.start) / self.over)


class Translate(Hold):
    """Held vertices that move by an offset at constant speed."""

    class Config(HandleConfig):
        """Displacement ``offset`` in metres, and the fields of `HandleConfig`."""

        effect: Literal["translate"] = "translate"
        offset: Vector

        def redirected(self, axes: Sequence[int]) -> Self:
            """Return a copy, its offset turned by 90 degrees in two ``axes`` or reversed in one."""
            offset = list(self.offset)
            first, second = axes[0], axes[min(1, len(axes) - 1)]
            offset[first], offset[second] = offset[second], -offset[first]
            return self.model_copy(update={"offset": tuple(offset)})

    moves = True

    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        return anchor + self.config.progress(frame) * np.array(self.config.offset)


AXES = {"x": 0, "y": 1, "z": 2}


class Rotate(Hold):
    """Held vertices that rotate at constant speed about an axis through the centre of the mesh."""

    class Config(HandleConfig):
        """Angle ``degrees``, right-handed about the direction ``axis``."""

        effect: Literal["rotate"] = "rotate"
        axis: Literal["x", "y", "z"]
        degrees: Annotated[float, Field(ge=-1e6, le=1e6)]

        def redirected(self, axes: Sequence[int]) -> Self:
            return self.model_copy(update={"degrees": -self.degrees})

    moves = True

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self._centre = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))

    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        angle = np.radians(self.config.degrees) * self.config.progress(frame)
        axis = AXES[self.config.axis]
        first, second = (axis + 1) % 3, (axis + 2) % 3
        c, s, centre = np.cos(angle), np.sin(angle), self._centre
        arm, turned = anchor - centre, anchor.copy()
        turned[:, first] = centre[first] + c * arm[:, first] - s * arm[:, second]
        turned[:, second] = centre[second] + s * arm[:, first] + c * arm[:, second]
        return turned
