"""Roles of effects, the base classes of each role, and a scene's list of effects.

A scene is a mesh and a list of effects. Each effect is one class with one typed configuration,
registered under the name that the configuration uses. It plays exactly one role, and the step loop
calls in each role only the effects that the scene lists:

=============  ===================================================  =========================
role           what it gives the step loop                          examples
=============  ===================================================  =========================
`Start`        initial velocity                                     kick
`Force`        acceleration of the frame                            gravity, wind
`Boundary`     which vertices are held, and where                   pins, translate, poke
`Contact`      correction of the end-of-frame positions             floor, sphere
constraint     local projection and its operator                    spring, strain (in
group                                                               `pdrom.model.constraints`)
=============  ===================================================  =========================
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationError

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import ConfigModel, describe, shown
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.types import Length, Mesh

# A vertex no deeper than this part of the extent touches an obstacle and is not inside.
TOUCHING = 1e-6


class ScaledWithFrames:
    """Marks a configuration field that counts frames and follows a change of the frame count."""


FrameNumber = Annotated[int, Field(ge=0, le=1_000_000), ScaledWithFrames()]
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]
Vector = tuple[Length, Length, Length]


class EffectConfig(ConfigModel):
    """Base of an effect's configuration: unknown keys are refused, instances are frozen."""

    effect: str

    def with_frames_scaled(self, factor: float) -> Self:
        """Same effect with every frame number multiplied by ``factor`` (a duration stays >= 1)."""
        changes: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            # also the markers inside ``FrameNumber | None``
            inside = getattr(field.annotation, "__args__", ())
            nested = [m for part in inside for m in getattr(part, "__metadata__", ())]
            if value and any(isinstance(m, ScaledWithFrames) for m in (*field.metadata, *nested)):
                changes[name] = max(1, round(value * factor))
        return self.model_copy(update=changes)

    def check_step(self, time_step: float) -> None:
        """Raise ValueError if the effect is unstable with a step of ``time_step`` s."""

    def redirected(self, axes: Sequence[int]) -> Self:
        """A handle that moves in another direction within ``axes``; other effects do not change."""
        return self

    def tilted(self, degrees: float, axes: Sequence[int], place: int) -> Self:
        """Gravity turned by ``degrees``; any other effect is unchanged.

        It turns towards ``axes[place]`` (of 0, 1, 2), counted without an axis along gravity.
        """
        return self

    def carried(self, offset: Sequence[float], over: int) -> "EffectConfig":
        """Pins that move by ``offset`` (m) in ``over`` frames; other effects are unchanged."""
        return self

    def body(self, low: np.ndarray, high: np.ndarray) -> Mesh | None:
        """Surface that pictures of the region from ``low`` to ``high`` (3,) m show."""
        return None


class Effect(ABC):
    """An effect bound to a mesh. ``Config`` is the typed configuration of the class."""

    Config: type[EffectConfig]

    in_subspace: ClassVar[bool] = True
    """Whether a position subspace takes the effect; one that it does not take is refused there."""

    def __init__(self, config: EffectConfig, mesh: Mesh, masses: np.ndarray) -> None:
        """Bind ``config`` to a mesh whose vertices have ``masses`` (N,) kg."""
        self.config: Any = config
        self.name: str = config.effect


class Start(Effect):
    """Sets the state before the first frame."""

    @abstractmethod
    def velocity(self) -> np.ndarray:
        """Initial velocity to add, (N, 3) m/s."""


class Force(Effect):
    """Accelerates the vertices.

    A position subspace takes forces that are affine in the velocity, with a rate for each vertex.
    """

    time_step: float
    """Step h of the run in seconds, which the scene sets: no force may overshoot in a frame."""

    rate: float | np.ndarray | None = None
    """Rate c, a number or (N,) 1/s, of an acceleration that is -c v and a part that does not depend
    on the motion; None for any other."""

    @abstractmethod
    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """Acceleration, (3,) or (N, 3) m/s^2, at ``positions`` m and ``velocities`` m/s (N, 3)."""

    def potential(self, positions: np.ndarray, masses: np.ndarray) -> float:
        """Potential energy, J, at ``positions`` (N, 3) m of ``masses`` (N,) kg, up to a constant.

        A force that has no potential (damping) adds none.
        """
        return 0.0


class Boundary(Effect):
    """Prescribes positions. Held vertices are eliminated from the system, not penalised."""

    vertices: np.ndarray
    """All vertices that the effect may ever hold, ascending (n,) int64."""

    side: str | None = None
    """Side of the rest shape that chose the vertices; None if they were listed or computed."""

    moves: bool
    """Whether the targets move while held."""

    @abstractmethod
    def active(self, frame: int) -> bool:
        """Whether anything is held in ``frame`` (0-based: the step from state f to f + 1)."""

    @abstractmethod
    def held(self, frame: int) -> np.ndarray:
        """Vertices that are held in an active ``frame``, (n,) int64."""

    @abstractmethod
    def targets(self, frame: int, current: np.ndarray) -> np.ndarray:
        """Positions (n, 3) m of the held vertices at the end of ``frame``.

        ``current`` (n, 3) are their positions at its beginning; the effect remembers where they
        were when it took hold of them.
        """

    def takes_hold(self, frame: int) -> bool:
        """Whether the targets of ``frame`` depend on the positions at its beginning."""
        return True

    def path(self, frames: range, current: np.ndarray) -> np.ndarray:
        """`targets` (f, n, 3) of ``frames``; only the first may take hold of ``current`` (n, 3)."""
        first = self.targets(frames.start, current)
        if not self.moves:
            return np.broadcast_to(first, (len(frames), *first.shape))
        return np.array([first, *(self.targets(frame, current) for frame in frames[1:])])

    @abstractmethod
    def units(self) -> list[np.ndarray]:
        """Sets of vertices that are always held together."""


class Contact(Effect):
    """Corrects positions at the end of a frame. Held vertices have infinite mass: none moves."""

    each_alone: ClassVar[bool] = True
    """Whether a vertex is corrected by itself, whatever the others do."""

    height: float | None = None
    """y in metres of a contact that does nothing but lift vertices to it."""

    def gaps(self, points: np.ndarray) -> np.ndarray:
        """Distances (n,) m of ``points`` (n, 3) m to the obstacle; inf if there is none."""
        return np.full(len(points), np.inf)

    def apply(self, positions: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        """`correct` all vertices but those ``held`` (n,), in place.

        A contact that shares a correction between vertices overrides this.

        Parameters
        ----------
        positions, before : (N, 3) m at the end and at the beginning of the frame
        """
        targets = positions[held]
        self.correct(positions, before)
        positions[held] = targets

    @abstractmethod
    def correct(self, positions: np.ndarray, before: np.ndarray) -> None:
        """Change positions (N, 3) m in place; ``before`` (N, 3) are those at the frame's beginning.

        What a scene lists later has the last word.
        """

    def doubt(self, rest: np.ndarray, free: np.ndarray) -> str:
        """Say what is odd about ``rest`` (N, 3) m with its ``free`` vertices (n,); "" if nothing.

        By default: vertices that the first frame moves, whatever the forces.
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
    """Typed configuration of ``entry``, number ``index`` of ``effects``; ValueError for a fault."""
    if isinstance(entry, EffectConfig):
        return entry
    if not isinstance(entry, dict) or not isinstance(entry.get("effect"), str):
        raise ValueError(f"effects[{index}] = {shown(entry, 60)}: a mapping with a key 'effect'")
    try:
        model = EFFECTS.load(entry["effect"]).Config
    except ConfigurationError as error:
        raise ValueError(f"effects[{index}]: {error}") from error
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        fault = describe(error, model)
        raise ValueError(f"effects[{index}] ({entry['effect']}): {fault}") from error


def _typed(entries: Any) -> tuple[EffectConfig, ...]:
    if not isinstance(entries, (list, tuple)):
        raise ValueError("a list of effects is required")
    return tuple(effect_config(entry, index) for index, entry in enumerate(entries))


EffectConfigs = Annotated[tuple[SerializeAsAny[EffectConfig], ...], BeforeValidator(_typed)]


def held_vertices(boundaries: Sequence[Boundary], frame: int) -> np.ndarray:
    """Vertices that any of the ``boundaries`` holds in ``frame``, ascending (n,) int64."""
    held = [b.held(frame) for b in boundaries if b.active(frame)]
    return np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.int64)


def held_targets(
    boundaries: Sequence[Boundary], frame: int, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The vertices that are held in ``frame``, as `held_vertices`, and their targets (n, 3) m.

    ``positions`` (N, 3) m are those at the frame's beginning; ``boundaries`` are the scene's.
    """
    vertices, path = held_path(boundaries, range(frame, frame + 1), positions)
    return vertices, path[0]


def held_path(
    boundaries: Sequence[Boundary], frames: range, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`held_targets` of the first of ``frames``, and of those whose targets are known by then.

    Targets are (n, m, 3) m for n >= 1 frames: up to the first in which others are held, or in which
    any are taken hold of.

    Parameters
    ----------
    positions : (N, 3) m at the beginning of the first frame
    """
    active = [b for b in boundaries if b.active(frames.start)]
    held = [b.held(frames.start) for b in active]
    current = [positions[v] for v in held]
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
    paths = [b.path(frames[:known], q) for b, q in zip(active, current, strict=True)]
    if single:
        return vertices, np.array(paths[0], order="C")  # a view is another type, compiled again
    return vertices, np.concatenate([np.empty((known, 0, 3)), *paths], axis=1)[:, first]
