"""Boundary conditions on the positions of vertices in some frames: pins, and moving handles."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.core.yamlfile import ConfigModel
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
        """Return the fraction of the path, 0 to 1, completed at the end of ``frame``."""
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


Degrees = Annotated[float, Field(ge=-1e6, le=1e6)]


class Key(ConfigModel):
    """Pose of a handle ``at`` this number of frames after the hold begins.

    offset : displacement since the beginning of the hold, m
    turn : rotation vector in degrees (its direction is the axis, its length the angle),
        right-handed about the centre of the held vertices' bounding box when the hold begins
    """

    at: Annotated[int, Field(ge=1, le=1_000_000)]
    offset: Vector = (0.0, 0.0, 0.0)
    turn: tuple[Degrees, Degrees, Degrees] = (0.0, 0.0, 0.0)


class Keyframes(Hold):
    """Held vertices that move as a rigid body from pose to pose and stay in the last one.

    Offsets and rotation vectors are interpolated: ``linear``, with a kink at each pose, or
    ``smooth``, by monotone cubics without overshoot (Fritsch and Butland 1984). Angles above 180
    degrees are possible, because vectors are interpolated, not rotations.
    """

    class Config(HoldConfig):
        """Poses ``keys`` in order of time; frame ``start`` begins with zero offset and rotation."""

        effect: Literal["keyframes"] = "keyframes"
        keys: Annotated[tuple[Key, ...], Field(min_length=1, max_length=10_000)]
        interpolation: Literal["linear", "smooth"] = "linear"

        @model_validator(mode="after")
        def _in_time_order(self) -> Self:
            for before, key in zip(self.keys, self.keys[1:], strict=False):
                if key.at <= before.at:
                    raise ValueError(f"keys: at = {key.at} must be greater than {before.at}")
            return self

        def with_frames_scaled(self, factor: float) -> Self:
            """Return a copy with frame numbers times ``factor``, poses at least 1 frame apart."""
            keys: list[Key] = []
            for key in self.keys:
                first = keys[-1].at + 1 if keys else 1
                keys.append(key.model_copy(update={"at": max(first, round(key.at * factor))}))
            scaled = super().with_frames_scaled(factor)
            return scaled.model_copy(update={"keys": tuple(keys)})

        def redirected(self, axes: Sequence[int]) -> Self:
            keys = []
            for key in self.keys:
                back = {name: tuple(-x for x in getattr(key, name)) for name in ("offset", "turn")}
                keys.append(key.model_copy(update=back))
            return self.model_copy(update={"keys": tuple(keys)})

    moves = True

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        poses = [np.concatenate([key.offset, key.turn]) for key in config.keys]
        self._times = np.array([0, *(key.at for key in config.keys)], dtype=float)
        self._poses = np.stack([np.zeros(6), *poses])
        self._smooth = config.interpolation == "smooth"

    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        from scipy.interpolate import PchipInterpolator
        from scipy.spatial.transform import Rotation

        time = min(frame + 1 - self.config.start, self._times[-1])
        if self._smooth:
            pose = PchipInterpolator(self._times, self._poses)(time)
        else:
            pose = np.array([np.interp(time, self._times, line) for line in self._poses.T])
        offset, turn = pose[:3], pose[3:]
        middle = 0.5 * (anchor.min(axis=0) + anchor.max(axis=0))
        rotation = Rotation.from_rotvec(turn, degrees=True)
        return middle + rotation.apply(anchor - middle) + offset
