"""Base classes of effects, one for each role, and the configuration of a scene's effects.

A scene is a mesh and a list of effects. Each effect is a class with a typed configuration, listed
by the name that scene files use. An effect has exactly one role, which determines what the step
loop uses of it:

`Start` : initial velocity (kick, velocity)
`Force` : acceleration of the frame (gravity, wind)
`Boundary` : held (prescribed) vertices and their positions (pins, translate, poke)
`Contact` : correction of the end-of-frame positions (floor, sphere)
constraint group : local projection and its operator (spring, strain; `pdrom.model.constraints`)
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationError

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import ConfigModel, describe, shown
from pdrom.model.effects import EFFECTS, MATERIALS
from pdrom.model.mesh.types import Length, Mesh

# A vertex inside an obstacle by at most this fraction of the mesh's longest side only touches it.
TOUCHING = 1e-6


# Marker of configuration fields that scale with the number of frames of a scene.
SCALED = "scaled with frames"
FrameNumber = Annotated[int, Field(ge=0, le=1_000_000), SCALED]
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]
Vector = tuple[Length, Length, Length]


class EffectConfig(ConfigModel):
    """Base class of effect configurations: unknown keys are refused, instances are frozen."""

    effect: str

    def with_frames_scaled(self, factor: float) -> Self:
        """Return the effect with frame numbers times ``factor``; nonzero ones become at least 1."""
        changes: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            # in type ``FrameNumber | None`` the marker is inside the union
            inside = getattr(field.annotation, "__args__", ())
            nested = [m for part in inside for m in getattr(part, "__metadata__", ())]
            if value and SCALED in (*field.metadata, *nested):
                changes[name] = max(1, round(value * factor))
        return self.model_copy(update=changes)

    def parts(self) -> tuple["EffectConfig", ...]:
        """Return the effects that this one stands for: itself, or the groups of a material."""
        return (self,)

    def check_step(self, time_step: float) -> None:
        """Raise ValueError if the effect is unstable with a time step of ``time_step`` s."""

    def redirected(self, axes: Sequence[int]) -> Self:
        """Return the effect; handles move in reverse or turned in the plane of ``axes``."""
        return self

    def tilted(self, degrees: float, axes: Sequence[int], place: int) -> Self:
        """Return the effect; gravity is turned by ``degrees``, other effects do not change.

        Of the ``axes`` (0: x) not parallel to gravity, it turns towards number ``place``.
        """
        return self

    def carried(self, offset: Sequence[float], over: int) -> "EffectConfig":
        """Return the effect; only pins change: they move by ``offset`` m in ``over`` frames."""
        return self

    def body(self, low: np.ndarray, high: np.ndarray) -> Mesh | None:
        """Return a surface to draw the effect near a box ``low`` to ``high`` m; None: not drawn."""
        return None


class Effect(ABC):
    """An effect bound to a mesh. ``Config`` is the typed configuration of the class."""

    Config: type[EffectConfig]
    in_subspace: ClassVar[bool] = True
    """Whether the effect is supported in a position subspace (an error is raised otherwise)."""

    def __init__(self, config: EffectConfig, mesh: Mesh, masses: np.ndarray) -> None:
        """Bind ``config`` to a mesh whose vertices have ``masses`` (N,) kg."""
        self.mesh, self.masses = mesh, masses
        self.config: Any = config
        self.name: str = config.effect


class Start(Effect):
    """Effect on the state before the first frame."""

    @abstractmethod
    def velocity(self) -> np.ndarray:
        """Return the velocity (N, 3) or (3,) m/s that is added to the initial velocity."""


class Force(Effect):
    """Effect that accelerates the vertices.

    In a position subspace, accelerations can only be a - c v, with constants a and c per vertex.
    """

    time_step: float
    """Time step h of the run in seconds, set by the scene; some forces depend on it."""
    rate: float | np.ndarray | None = None
    """Rate c, a number or (N,) 1/s, if the acceleration is -c v plus a term that does not depend on
    positions or velocities; None for any other force."""

    @abstractmethod
    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Return the acceleration (3,) or (N, 3) m/s^2 at ``positions`` m, ``velocities`` m/s."""

    def potential(self, positions: np.ndarray, masses: np.ndarray) -> float:
        """Return the potential energy, J, of ``masses`` (N,) kg at ``positions`` (N, 3) m.

        It is defined up to a constant, and zero for a force without potential (damping).
        """
        return 0.0


class Boundary(Effect):
    """Boundary condition: holds vertices at given positions by eliminating them from the system."""

    vertices: np.ndarray
    """All vertices that the effect holds in any frame, ascending (n,) int64."""
    side: str | None = None
    """Name of the side of the rest shape that selected the vertices; None if no side did."""
    moves: bool
    """Whether the targets change from frame to frame."""

    @abstractmethod
    def active(self, frame: int) -> bool:
        """Return whether vertices are held in ``frame`` f, the step from state f to f + 1."""

    @abstractmethod
    def held(self, frame: int) -> np.ndarray:
        """Return the vertices (n,) int64 that are held in ``frame``, in which it is `active`."""

    @abstractmethod
    def targets(self, frame: int, anchor: np.ndarray) -> np.ndarray:
        """Return the positions (n, 3) m of the held vertices at the end of ``frame``.

        ``anchor`` (n, 3) m are their positions at the beginning of the hold, see `anchor`.
        """

    def anchor(self, frame: int, positions: np.ndarray) -> np.ndarray:
        """Return the part (n, 3) m of ``positions`` (N, 3) of the vertices held in ``frame``."""
        return positions[self.held(frame)]

    def takes_hold(self, frame: int) -> bool:
        """Return whether a hold, whose targets depend on present positions, begins in ``frame``."""
        return True

    def path(self, frames: range, anchor: np.ndarray) -> np.ndarray:
        """Return `targets` (f, n, 3) m in f ``frames``; a hold may begin only in the first."""
        if not self.moves:
            first = self.targets(frames.start, anchor)
            return np.broadcast_to(first, (len(frames), *first.shape))
        return np.array([self.targets(frame, anchor) for frame in frames])

    @abstractmethod
    def units(self) -> list[np.ndarray]:
        """Return sets of vertices; the vertices of one set are always held in the same frames."""


class Contact(Effect):
    """Effect that corrects positions at the end of a frame, except those of held vertices."""

    each_alone: ClassVar[bool] = True
    """Whether the correction of a vertex does not depend on other vertices."""
    height: float | None = None
    """Height y, m, for a floor: a contact that only moves lower vertices up to y; else None."""

    def apply(self, positions: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        """Resolve the contact, changing ``positions`` of all vertices except ``held`` (n,).

        A contact that moves several vertices together (self-collision) overrides this method.

        positions, before : (N, 3) m at the end and at the beginning of the frame
        """
        targets = positions[held]
        self.correct(positions, before)
        positions[held] = targets

    @abstractmethod
    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        """Correct ``positions`` (N, 3) m in place; ``before`` (N, 3) m are from before the frame.

        Contacts are applied in the order of the scene's effects.
        """

    def doubt(self, rest: np.ndarray, free: np.ndarray) -> str:
        """Return a warning if the contact does not suit the rest shape ``rest`` (N, 3) m, else "".

        By default it warns if the contact moves ``free`` (not held) vertices (n,) in frame 0.
        """
        moved = rest.copy()
        self.correct(moved, rest)
        distances = np.linalg.norm(moved - rest, axis=1)[free]
        count = np.count_nonzero(distances > TOUCHING * np.ptp(rest, axis=0).max())
        if not count:
            return ""
        return (
            f"{count} of {len(free)} free vertices lie inside it at rest and are moved by up to "
            f"{distances.max():.3g} m in the first frame"
        )


def effect_config(entry: Any, index: int) -> EffectConfig:
    """Return the configuration of ``entry``, effect number ``index``; ValueError if invalid."""
    if isinstance(entry, EffectConfig):
        return entry
    if not isinstance(entry, dict) or not isinstance(entry.get("effect"), str):
        raise ValueError(f"effects[{index}] = {shown(entry, 60)}: no mapping with a key 'effect'")
    name = entry["effect"]
    try:
        model = EFFECTS.load(name).Config
    except ConfigurationError as error:
        raise ValueError(f"effects[{index}]: {error}") from error
    if name in MATERIALS and {"young", "poisson", "thickness"} & entry.keys():
        model = MATERIALS.load(name)
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        fault = describe(error, model)
        raise ValueError(f"effects[{index}] ({name}): {fault}") from error


def _typed(entries: Any) -> tuple[EffectConfig, ...]:
    if not isinstance(entries, (list, tuple)):
        raise ValueError("a list of effects is required")
    configs = [effect_config(entry, index) for index, entry in enumerate(entries)]
    return tuple(part for config in configs for part in config.parts())


EffectConfigs = Annotated[tuple[SerializeAsAny[EffectConfig], ...], BeforeValidator(_typed)]


def held_vertices(boundaries: Sequence[Boundary], frame: int) -> np.ndarray:
    """Return the vertices that any of ``boundaries`` holds in ``frame``, ascending (n,) int64."""
    held = [b.held(frame) for b in boundaries if b.active(frame)]
    return np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.int64)


Anchors = tuple[np.ndarray | None, ...]
"""For each boundary condition the positions (n, 3) m at which its present hold began, or None."""
Held = tuple[np.ndarray, np.ndarray, Anchors]
"""Held vertices, their targets, anchors for the next frame."""


def held_path(
    boundaries: Sequence[Boundary], frames: range, positions: np.ndarray, anchors: Anchors = ()
) -> Held:
    """Return held vertices (m,), their targets (n, m, 3) m in the first n >= 1 ``frames``, anchors.

    These frames end before the first in which the set of held vertices changes or a hold begins,
    since targets of that hold depend on positions that are not yet known. ``positions`` (N, 3) m
    are from the beginning of the first frame, ``anchors`` the third result for the previous one.
    A hold without an anchor is assumed to begin in the first frame.
    """
    frame, now = frames.start, list(anchors) or [None] * len(boundaries)
    for i, b in enumerate(boundaries):
        if not b.active(frame):
            now[i] = None
        elif now[i] is None or b.takes_hold(frame):
            now[i] = b.anchor(frame, positions)
    pairs = [(b, q) for b, q in zip(boundaries, now, strict=True) if q is not None]
    active = [b for b, _ in pairs]
    held = [b.held(frame) for b in active]
    single = len(active) == 1 and bool((held[0][1:] > held[0][:-1]).all())
    vertices, first = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    if single:
        vertices = held[0]
    elif active:
        vertices, first = np.unique(np.concatenate(held), return_index=True)
    known = 1
    while known < len(frames) and not (
        any(b.active(frames[known]) != (b in active) for b in boundaries)
        or any(b.takes_hold(frames[known]) for b in active)
    ):
        known += 1
    paths = [b.path(frames[:known], q) for b, q in pairs]
    if single:
        path = paths[0]
    else:
        path = np.concatenate([np.empty((known, 0, 3)), *paths], axis=1)[:, first]
    return vertices, np.array(path, order="C"), tuple(now)  # Numba compiles for one memory layout
