"""A handle whose held vertices follow given offsets and rotations over time."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.effects.base import Vector
from pdrom.model.effects.hold import Hold, HoldConfig
from pdrom.model.mesh.types import Mesh

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
    ``smooth``, by monotone cubics without overshoot (Fritsch and Butland 1984). As these vectors,
    not rotations, are interpolated, angles above 180 degrees are possible.
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
            keys = [
                key.model_copy(
                    update={name: tuple(-x for x in getattr(key, name)) for name in POSE}
                )
                for key in self.keys
            ]
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


POSE = ("offset", "turn")
