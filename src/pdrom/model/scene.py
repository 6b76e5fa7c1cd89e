"""A scene: a mesh and a list of effects, typed, checked, and bound to the step loop.

Contradictions of what holds vertices or stops them are refused, doubts are logged. Masses are
lumped: one for all vertices, or by selection."""

import logging
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.constraints.base import ConstraintGroup, GroupConfig
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import LocalStep, State, Stepper
from pdrom.model.dynamics.system import DEFAULT_SOLVER, GlobalSystem
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import (
    Boundary,
    Contact,
    EffectConfig,
    EffectConfigs,
    Force,
    Start,
    bind,
    held_targets,
)
from pdrom.model.held_out import FIRST, HeldOut, HeldOutMotion
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh, vertex_measures

Mass = Annotated[float, Field(ge=1e-150, le=1e150)]


class MassConfig(ConfigModel):
    """Mass of the vertices of ``select`` (all if it is left out), given in one of two ways.

    vertex_mass : kg a vertex
    density : kg/m^2 of a surface, kg/m^3 of a volume; a vertex has its share of the rest shape
    """

    select: Selection | None = None
    vertex_mass: Mass | None = None
    density: Mass | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.vertex_mass is None) == (self.density is None):
            raise ValueError("either vertex_mass or density is required")
        return self


def vertex_masses(
    mesh: Mesh, scene: str, vertex_mass: float, entries: tuple[MassConfig, ...]
) -> np.ndarray:
    """Masses (N,) kg of ``scene``: ``vertex_mass``, changed by each of ``entries`` in turn.

    Raises
    ------
    SceneError
        A selection that the mesh does not have.
    """
    masses = np.full(mesh.vertices, vertex_mass)
    for number, entry in enumerate(entries):
        try:
            masses = _changed(masses, mesh, entry)
        except SceneError as error:
            raise SceneError(f"scene '{scene}', masses[{number}]: {error}") from error
    return masses


def _changed(masses: np.ndarray, mesh: Mesh, entry: MassConfig) -> np.ndarray:
    chosen = np.arange(mesh.vertices)
    if entry.select is not None:
        chosen = select_vertices(mesh, entry.select)
    masses = masses.copy()
    if entry.density is None:
        masses[chosen] = entry.vertex_mass
    else:
        masses[chosen] = entry.density * vertex_measures(mesh)[chosen]
    return masses


class ReductionPlan(ConfigModel):
    """Experiments on one group: how many training snapshots its basis gets."""

    train: Annotated[int, Field(ge=2, le=100_000)]


def with_requested_error(keys: Any) -> Any:
    """Separate ``reduce.error``, the requested tolerance of the scene, from the groups' plans.

    ``keys`` are those of a scene file as read, and come back unchanged where none is requested.
    """
    plans = keys.get("reduce") if isinstance(keys, dict) else None
    if not isinstance(plans, dict) or "error" not in plans:
        return keys
    groups = {name: plan for name, plan in plans.items() if name != "error"}
    return {**keys, "reduce": groups, "requested_error": plans["error"]}


# Positions and velocities of a longer run fill disk and memory: 1600 vertices for 100,000 frames.
MAX_VERTEX_FRAMES = 160_000_000


class _Model(ConfigModel):
    """Base of the sections of a scene."""


class SceneConfig(_Model):
    """Configuration of a scene (config/scenes/*.yaml). Units: seconds, metres, kilograms.

    ``requested_error`` is the error that ``pdrom reduce`` keeps to, also written ``reduce.error``.
    """

    name: SceneName
    title: str
    mesh: MeshConfig
    time_step: Annotated[float, Field(ge=1e-9, le=10.0)] = 0.016
    iterations: Annotated[int, Field(ge=1, le=10_000)] = 10
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 0
    frames: Annotated[int, Field(ge=1, le=1_000_000)]
    vertex_mass: Mass = 10.0
    masses: tuple[MassConfig, ...] = ()
    effects: EffectConfigs
    reduce: dict[str, ReductionPlan] = Field(default_factory=dict)
    requested_error: float | str | None = None
    held_out: HeldOut = HeldOut()

    _requested = model_validator(mode="before")(with_requested_error)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        groups = self.groups
        if not groups:
            raise ValueError("effects list no constraint group: there is nothing to project")
        if len(set(groups)) < len(groups):
            raise ValueError(f"effects list a constraint group twice: {', '.join(groups)}")
        for effect in self.effects:
            effect.check_step(self.time_step)
        for group, plan in self.reduce.items():
            if group not in groups:
                raise ValueError(f"reduce.{group}: not in effects (allowed: {', '.join(groups)})")
            even = (self.frames + 1) // 2
            if plan.train > even:
                raise ValueError(
                    f"reduce.{group}.train = {plan.train}: only {even} even frames in {self.frames}"
                )
        return self

    @property
    def groups(self) -> list[str]:
        """Names of the constraint groups, in the order of the effects."""
        return [e.effect for e in self.effects if isinstance(e, GroupConfig)]

    def effects_without(self, *names: str) -> tuple[EffectConfig, ...]:
        """Effects of the scene without those called one of ``names``, in their order."""
        return tuple(e for e in self.effects if e.effect not in names)

    @property
    def modules(self) -> list[str]:
        """Places of the listed effects (for the code fingerprint), "module:attribute"."""
        return sorted({EFFECTS[e.effect] for e in self.effects})

    def coarsened(self, resolution: float, frames: float) -> Self:
        """The scene with shares of its ``resolution`` and ``frames``; schedules shrink alike."""
        count = max(4, round(self.frames * frames))
        even = (count + 1) // 2
        plans = {
            group: ReductionPlan(train=max(2, min(round(plan.train * frames), even)))
            for group, plan in self.reduce.items()
        }
        return self.model_copy(
            update={
                "mesh": self.mesh.coarsened(resolution),
                "frames": count,
                "effects": tuple(e.with_frames_scaled(frames) for e in self.effects),
                "reduce": plans,
            }
        )

    def heldout_variant(self, motion: HeldOutMotion = FIRST) -> Self:
        """The scene of the held-out ``motion`` (see `HeldOut`)."""
        return self.model_copy(update={"effects": self.held_out.variant(self.effects, motion)})


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene bound to its mesh: every listed effect built, sorted by role."""

    config: SceneConfig
    mesh: Mesh
    masses: np.ndarray
    groups: list[ConstraintGroup]
    forces: list[Force]
    boundaries: list[Boundary]
    contacts: list[Contact]
    starts: list[Start]

    def __repr__(self) -> str:
        size = f"{self.mesh.vertices} vertices, {self.config.frames} frames"
        effects = ", ".join(each.effect for each in self.config.effects)
        return f"Scene('{self.config.name}', {size}: {effects})"

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy, also a pickled one, is built again: compiled kernels cannot be pickled."""
        return Scene.build, (self.config, self.mesh, self.masses)

    @classmethod
    def build(cls, config: SceneConfig, mesh: Mesh, masses: np.ndarray | None = None) -> "Scene":
        """Bind ``config`` to ``mesh``.

        Parameters
        ----------
        masses : (N,) kg in place of those of ``config``

        Raises
        ------
        MeshError, SceneError
            Faulty mesh, an empty selection, or effects that hold a vertex in different places.
        """
        check_mesh(mesh, config.name)
        if config.frames * mesh.vertices > MAX_VERTEX_FRAMES:
            raise SceneError(
                f"scene '{config.name}': frames = {config.frames} on {mesh.vertices} vertices: "
                f"allowed are at most {MAX_VERTEX_FRAMES // mesh.vertices} frames"
            )
        if masses is None:
            masses = vertex_masses(mesh, config.name, config.vertex_mass, entries=config.masses)
        return cls._bound(config, mesh, masses)

    @classmethod
    def _bound(cls, config: SceneConfig, mesh: Mesh, masses: np.ndarray) -> "Scene":
        effects = [bind(entry, config.name, mesh, masses) for entry in config.effects]
        scene = cls(
            config,
            mesh,
            masses,
            groups=[e for e in effects if isinstance(e, ConstraintGroup)],
            forces=[e for e in effects if isinstance(e, Force)],
            boundaries=[e for e in effects if isinstance(e, Boundary)],
            contacts=[e for e in effects if isinstance(e, Contact)],
            starts=[e for e in effects if isinstance(e, Start)],
        )
        check_holds(scene.boundaries, config.name, config.frames)
        for force in scene.forces:
            force.time_step = config.time_step
        return scene

    def changed(self, **keys: Any) -> "Scene":
        """The scene with other ``keys`` of its configuration, on the same mesh of the same masses.

        Raises
        ------
        MeshError, SceneError
            As `build`, of effects.
        """
        config = self.config.model_copy(update=keys)
        return self._bound(config, self.mesh, self.masses)

    def log_holds(self) -> None:
        """Log how many vertices each effect holds, and which an obstacle wants elsewhere."""
        name, points, frames = self.config.name, self.mesh.points, self.config.frames
        log_holds(self.boundaries, name, len(points))
        log_obstructed(self.boundaries, self.contacts, name, points=points, frames=frames)

    def log_contacts(self) -> None:
        """Warn of contacts that do not fit the rest shape, see `Contact.doubt`."""
        log_contacts(self.contacts, self.boundaries, self.config.name, rest=self.mesh.points)

    def group(self, name: str) -> ConstraintGroup:
        """The constraint group called ``name``; SceneError if the scene does not list it."""
        for group in self.groups:
            if group.name == name:
                return group
        raise SceneError(f"{self.config.name}: no group '{name}' ({', '.join(self.config.groups)})")

    @cached_property
    def system(self) -> GlobalSystem:
        """Global system with the default solver, built once."""
        return self.system_with(DEFAULT_SOLVER)

    def system_with(self, solver: str) -> GlobalSystem:
        """Global system solved by the registered ``solver``."""
        return GlobalSystem(self.masses, self.config.time_step, self.groups, solver=solver)

    def initial_state(self, perturbation: np.ndarray | None = None) -> State:
        """State before the first frame; ``perturbation`` (N, 3) m is added to the positions."""
        positions = self.mesh.points.copy()
        if perturbation is not None:
            positions += perturbation
        velocities = np.zeros_like(positions)
        for start in self.starts:
            velocities += start.velocity()
        return State(positions, velocities)

    def stepper(
        self,
        system: GlobalSystem | None = None,
        local_steps: Sequence[LocalStep] | None = None,
        track_objective: bool = True,
    ) -> Stepper:
        """Step loop of the scene; ``local_steps`` replaces the full projections of all groups.

        ``system`` replaces its factored system, ``track_objective`` adds the objective to reports.
        """
        return Stepper(
            self.space(system or self.system),
            self.config.time_step,
            self.config.iterations,
            local_steps=self.groups if local_steps is None else local_steps,
            track_objective=track_objective,
            acceleration=self.acceleration(),
        )

    def acceleration(self) -> Anderson | None:
        """Acceleration of the iterations, None if the scene has none."""
        window = self.config.anderson_window
        return Anderson(window) if window else None

    def space(self, system: GlobalSystem) -> VertexSpace:
        """Vertex positions as the coordinates of the step loop, with its global ``system``."""
        return VertexSpace(system, self.forces, self.boundaries, contacts=self.contacts)


log = logging.getLogger(__name__)

# Fewer vertices leave a body free to turn about a line.
FEW = 3
# Targets no deeper in an obstacle than this part of the extent lie on it.
SLACK = 1e-9
# Vertices that a message names.
NAMED = 10


def check_holds(boundaries: Sequence[Boundary], scene: str, frames: int) -> None:
    """SceneError for a vertex that is held twice at once, unless nothing that holds it moves."""
    for first, second in combinations(boundaries, 2):
        if not (first.moves or second.moves):
            continue
        shared = np.intersect1d(first.vertices, second.vertices)
        if len(shared) == 0:
            continue
        for frame in range(frames):
            if first.active(frame) and second.active(frame):
                raise SceneError(
                    f"scene '{scene}': vertex {shared[0]} is held by '{first.name}' and by "
                    f"'{second.name}' in frame {frame}"
                )


def log_holds(boundaries: Sequence[Boundary], scene: str, vertices: int) -> None:
    """Log how many of the ``vertices`` of ``scene`` (name) each of its ``boundaries`` holds.

    A side that holds fewer than `FEW` is a warning: on an unstructured mesh a side is often one
    single vertex.
    """
    for boundary in boundaries:
        count = len(boundary.vertices)
        counted = f"scene '{scene}', effect '{boundary.name}': holds {count} of {vertices} vertices"
        if boundary.side is None:
            log.info("%s", counted)
        elif count >= FEW:
            log.info("%s (select: %s)", counted, boundary.side)
        else:
            advice = "a list of vertices selects more"
            log.warning("%s, fewer than %d (select: %s; %s)", counted, FEW, boundary.side, advice)


def log_obstructed(
    boundaries: Sequence[Boundary],
    contacts: Sequence[Contact],
    scene: str,
    points: np.ndarray,
    frames: int,
) -> None:
    """Warn of held vertices whose targets lie inside an obstacle, where they stay.

    Vertices that are taken hold of later are taken to be where obstacles have pushed the mesh at
    rest, ``points`` (N, 3) m.
    """
    obstacles = [contact for contact in contacts if contact.each_alone]
    inside, blocked = np.zeros(len(points), dtype=bool), dict[str, None]()
    # boundaries remember where they took hold
    boundaries, positions = deepcopy(boundaries), points.copy()
    slack = SLACK * float(np.ptp(points, axis=0).max())
    for frame in range(frames if obstacles and boundaries else 0):
        held, targets = held_targets(boundaries, frame, positions)
        positions[held] = targets
        for obstacle in obstacles:
            before = positions.copy()
            obstacle.correct(positions, before)
            pushed = held[np.linalg.norm(positions[held] - targets, axis=1) > slack]
            positions[held] = targets
            if len(pushed):
                inside[pushed], blocked[obstacle.name] = True, None
    vertices = np.flatnonzero(inside)
    if len(vertices):
        named = ", ".join(map(str, vertices[:NAMED])) + (", ..." if len(vertices) > NAMED else "")
        log.warning(
            "scene '%s': %d held vertices have targets inside '%s' and stay there: %s",
            scene, len(vertices), "', '".join(blocked), named,
        )  # fmt: skip


def log_contacts(
    contacts: Sequence[Contact], boundaries: Sequence[Boundary], scene: str, rest: np.ndarray
) -> None:
    """Warn of contacts that do not fit the shape ``rest`` (N, 3) m; held vertices do not count."""
    free = np.ones(len(rest), dtype=bool)
    for boundary in boundaries:
        if boundary.active(0):
            free[boundary.held(0)] = False
    for contact in contacts:
        doubt = contact.doubt(rest, np.flatnonzero(free)) if free.any() else ""
        if doubt:
            log.warning("scene '%s', effect '%s': %s", scene, contact.name, doubt)
