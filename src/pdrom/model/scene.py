"""Scenes: a mesh and a list of effects, their typed configuration, and their step loop.

Effects that prescribe contradictory positions raise an error; implausible effects are logged
as warnings. Masses are lumped at the vertices and may differ between selected vertices."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.constraints.base import ConstraintGroup, GroupConfig
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.convergence import EstimatingStepper, Iterations, Until
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import LocalStep, State, Stepper
from pdrom.model.dynamics.system import DEFAULT_SOLVER, GlobalSystem
from pdrom.model.effects import EFFECTS, base
from pdrom.model.held_out import FIRST, HeldOut, HeldOutMotion
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import Mesh, vertex_measures

log = logging.getLogger(__name__)

# A body that is held (fixed) at fewer vertices than this can rotate about a line.
FEW = 3
# Held vertices inside an obstacle by up to this fraction of the mesh's extent cause no warning.
SLACK = 1e-9
# Largest number of vertices that are listed in a message.
NAMED = 10
Mass = Annotated[float, Field(ge=1e-150, le=1e150)]


class MassConfig(ConfigModel):
    """Mass of the vertices of ``select`` (all if left out): ``vertex_mass`` or ``density``.

    vertex_mass : mass of each vertex, kg
    density : kg/m^2 of a surface, kg/m^3 of a volume; times the rest area or volume of a vertex
    """

    select: Selection | None = None
    vertex_mass: Mass | None = None
    density: Mass | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.vertex_mass is None) == (self.density is None):
            raise ValueError("give either vertex_mass or density: exactly one is required")
        return self


class ReductionPlan(ConfigModel):
    """Reduction of one constraint group: ``train`` is the number of its training snapshots."""

    train: Annotated[int, Field(ge=2, le=100_000)]


# Limit of vertices times frames, which bounds disk space and memory (1600 times 100,000).
MAX_VERTEX_FRAMES = 160_000_000


class SceneConfig(ConfigModel):
    """Configuration of a scene (config/scenes/*.yaml). Units: seconds, metres, kilograms."""

    name: SceneName
    title: str
    mesh: MeshConfig
    time_step: Annotated[float, Field(ge=1e-9, le=10.0)] = 0.016
    iterations: Iterations = 10
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 0
    frames: Annotated[int, Field(ge=1, le=1_000_000)]
    vertex_mass: Mass = 10.0
    masses: tuple[MassConfig, ...] = ()
    effects: base.EffectConfigs
    reduce: dict[str, ReductionPlan] = Field(default_factory=dict)
    held_out: HeldOut = HeldOut()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        groups = self.groups
        if not groups:
            raise ValueError("effects list no constraint group: add one (spring, strain, ...)")
        if len(set(groups)) < len(groups):
            doubled = {group for group in groups if groups.count(group) > 1} & {"volume", "area"}
            added = "; young with poisson adds volume or area" if doubled else ""
            raise ValueError(f"effects list a constraint group twice: {', '.join(groups)}{added}")
        for effect in self.effects:
            effect.check_step(self.time_step)
        for group, plan in self.reduce.items():
            if group not in groups:
                raise ValueError(f"reduce.{group}: not in effects (allowed: {', '.join(groups)})")
            even = (self.frames + 1) // 2
            if plan.train > even:
                raise ValueError(
                    f"reduce.{group}.train = {plan.train}: the scene has only {even} even frames"
                )
        return self

    @property
    def count(self) -> int:
        """Number of iterations of each frame; SceneError if it differs between frames."""
        if isinstance(self.iterations, int):
            return self.iterations
        fault = "only full-order runs iterate until an estimated error is reached; give a number"
        raise SceneError(f"scene '{self.name}': iterations = {dict(self.iterations)}: {fault}")

    @property
    def groups(self) -> list[str]:
        """Names of the constraint groups, in the order of the effects."""
        return [e.effect for e in self.effects if isinstance(e, GroupConfig)]

    def vertex_masses(self, mesh: Mesh) -> np.ndarray:
        """Return masses (N,) kg: ``vertex_mass``, then changed by each entry of ``masses`` in turn.

        Raises SceneError if a selection contains no vertex of ``mesh``, or does not exist on it.
        """
        masses = np.full(mesh.vertices, self.vertex_mass)
        for number, entry in enumerate(self.masses):
            chosen = np.arange(mesh.vertices)
            if entry.select is not None:
                try:
                    chosen = select_vertices(mesh, entry.select)
                except SceneError as error:
                    raise SceneError(f"scene '{self.name}', masses[{number}]: {error}") from error
            if entry.density is None:
                masses[chosen] = entry.vertex_mass
            else:
                masses[chosen] = entry.density * vertex_measures(mesh)[chosen]
        return masses

    def effects_without(self, *names: str) -> tuple[base.EffectConfig, ...]:
        """Return the effects of the scene whose names are not among ``names``, in their order."""
        return tuple(e for e in self.effects if e.effect not in names)

    @property
    def modules(self) -> list[str]:
        """Import paths "module:attribute" of all effects, for a checksum of the code in use."""
        return sorted({EFFECTS[e.effect] for e in self.effects})

    def coarsened(self, resolution: float, frames: float) -> Self:
        """Return the scene with vertices per side and frames multiplied by these two factors."""
        count = max(4, round(self.frames * frames))
        even = (count + 1) // 2
        plans = {
            group: ReductionPlan(train=max(2, min(round(plan.train * frames), even)))
            for group, plan in self.reduce.items()
        }
        changes = {"mesh": self.mesh.coarsened(resolution), "frames": count, "reduce": plans}
        effects = tuple(e.with_frames_scaled(frames) for e in self.effects)
        return self.model_copy(update=changes | {"effects": effects})

    def heldout_variant(self, motion: HeldOutMotion = FIRST) -> Self:
        """Return the configuration of the scene for the test trajectory ``motion`` (`HeldOut`)."""
        effects = self.held_out.variant(self.effects, motion, self.time_step)
        return self.model_copy(update={"effects": effects})

    def training_variant(self, seed: int) -> Self:
        """Return the configuration for another training trajectory, random with this ``seed``."""
        effects = self.held_out.further(self.effects, seed, self.time_step)
        return self.model_copy(update={"effects": effects})


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene on its mesh; effects are objects, in one list for each kind (groups, forces ...)."""

    config: SceneConfig
    mesh: Mesh
    masses: np.ndarray
    groups: list[ConstraintGroup]
    forces: list[base.Force]
    boundaries: list[base.Boundary]
    contacts: list[base.Contact]
    starts: list[base.Start]

    def __repr__(self) -> str:
        size = f"{self.mesh.vertices} vertices, {self.config.frames} frames"
        effects = ", ".join(each.effect for each in self.config.effects)
        return f"Scene('{self.config.name}', {size}: {effects})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Make copying and unpickling build the scene anew: compiled kernels cannot be pickled."""
        return Scene.build, (self.config, self.mesh, self.masses)

    @classmethod
    def build(cls, config: SceneConfig, mesh: Mesh, masses: np.ndarray | None = None) -> "Scene":
        """Return the scene of ``config`` on ``mesh``; if given, ``masses`` (N,) kg replace others.

        MeshError if the mesh is faulty, SceneError if a selection is empty, there are too many
        frames, or effects contradict each other.
        """
        check_mesh(mesh, config.name)
        if config.frames * mesh.vertices > MAX_VERTEX_FRAMES:
            raise SceneError(
                f"scene '{config.name}': frames = {config.frames} on {mesh.vertices} vertices: "
                f"allowed are at most {MAX_VERTEX_FRAMES // mesh.vertices} frames"
            )
        own = config.vertex_masses(mesh) if masses is None else masses
        return cls._bound(config, mesh, own)

    @classmethod
    def _bound(cls, config: SceneConfig, mesh: Mesh, masses: np.ndarray) -> "Scene":
        effects = []
        for entry in config.effects:
            try:
                effects.append(EFFECTS.load(entry.effect)(entry, mesh, masses))
            except SceneError as error:
                where = f"scene '{config.name}', effect '{entry.effect}'"
                raise SceneError(f"{where}: {error}") from error
        kinds = (ConstraintGroup, base.Force, base.Boundary, base.Contact, base.Start)
        lists: list[Any] = [[e for e in effects if isinstance(e, kind)] for kind in kinds]
        scene = cls(config, mesh, masses, *lists)
        scene._check_holds()
        for force in scene.forces:
            force.time_step = config.time_step
        return scene

    def changed(self, **keys: Any) -> "Scene":
        """Return the scene with ``keys`` of its configuration changed; mesh and masses are kept.

        SceneError if a changed effect does not suit the mesh or contradicts another effect.
        """
        config = self.config.model_copy(update=keys)
        return self._bound(config, self.mesh, self.masses)

    def iterated(self, iterations: int | Until, window: int = 0) -> "Scene":
        """Return the scene with these ``iterations`` and Anderson ``window`` (0: none)."""
        changes = {"iterations": iterations, "anderson_window": window}
        return replace(self, config=self.config.model_copy(update=changes))

    def _check_holds(self) -> None:
        """Raise SceneError if two effects prescribe different positions of a vertex in a frame."""
        for first, second in combinations(self.boundaries, 2):
            shared = np.intersect1d(first.vertices, second.vertices)
            if len(shared) == 0 or not (first.moves or second.moves):
                continue
            if _place(first) == _place(second):
                continue
            for frame in range(self.config.frames):
                if first.active(frame) and second.active(frame):
                    raise SceneError(
                        f"scene '{self.config.name}': vertex {shared[0]} is held by "
                        f"'{first.name}' and by '{second.name}' in frame {frame}: change one effect"
                    )

    def log_holds(self) -> None:
        """Log how many vertices each boundary condition holds (prescribes); call `log_obstructed`.

        Warn if a selected side has fewer than `FEW` vertices: on an unstructured mesh the side is
        often a single vertex.
        """
        for boundary in self.boundaries:
            count, side = len(boundary.vertices), boundary.side
            where = f"scene '{self.config.name}', effect '{boundary.name}'"
            counted = f"{where}: holds {count} of {self.mesh.vertices} vertices"
            if side is None:
                log.info("%s", counted)
            elif count >= FEW:
                log.info("%s (select: %s)", counted, side)
            else:
                advice = "list vertices to select more"
                log.warning("%s, fewer than %d (select: %s; %s)", counted, FEW, side, advice)
        log_obstructed(self)

    def log_contacts(self) -> None:
        """Log a warning, from `Contact.doubt`, for each contact that does not suit the rest shape.

        Vertices that are held (fixed) in the first frame are ignored.
        """
        held = base.held_vertices(self.boundaries, 0)
        free = np.setdiff1d(np.arange(self.mesh.vertices), held)
        for contact in self.contacts if len(free) else []:
            doubt = contact.doubt(self.mesh.points, free)
            if doubt:
                log.warning("scene '%s', effect '%s': %s", self.config.name, contact.name, doubt)

    def group(self, name: str) -> ConstraintGroup:
        """Return the constraint group with this ``name``; SceneError if the scene has none."""
        for group in self.groups:
            if group.name == name:
                return group
        raise SceneError(f"{self.config.name}: no group '{name}' ({', '.join(self.config.groups)})")

    @cached_property
    def system(self) -> GlobalSystem:
        """Global system with the default solver, made at the first access."""
        return self.system_with(DEFAULT_SOLVER)

    def system_with(self, solver: str) -> GlobalSystem:
        """Return the global system with the ``solver`` of this name (`solvers.SOLVERS`)."""
        return GlobalSystem(self.masses, self.config.time_step, self.groups, solver=solver)

    def initial_state(self, perturbation: np.ndarray | None = None) -> State:
        """Return the initial state, with ``perturbation`` (N, 3) m added to the positions."""
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
        estimate: bool = False,
    ) -> Stepper:
        """Return the step loop, with ``local_steps`` in place of the groups if given.

        ``system`` replaces the global system; ``track_objective`` adds objectives to frame reports.
        If ``estimate`` is true or frames iterate until an error, it is an `EstimatingStepper`.
        """
        asked, own = self.config.iterations, (self.mesh.extent, self.config.frames)
        until = asked if isinstance(asked, Until) and local_steps is None else None
        kind = partial(EstimatingStepper, until, *own) if until or estimate else Stepper
        return kind(
            self.space(system or self.system),
            self.config.time_step,
            until.most if until else self.config.count,
            local_steps=self.groups if local_steps is None else local_steps,
            track_objective=track_objective and until is None,
            acceleration=self.acceleration(),
        )

    def acceleration(self) -> Anderson | None:
        """Return a new Anderson acceleration of the iterations; None if the scene has none."""
        window = self.config.anderson_window
        return Anderson(window) if window else None

    def space(self, system: GlobalSystem) -> VertexSpace:
        """Return the unknowns of a full-order run: all positions, which ``system`` solves for."""
        return VertexSpace(system, self.forces, self.boundaries, contacts=self.contacts)


def _place(boundary: base.Boundary) -> base.EffectConfig:
    """Return the configuration that determines how the vertices of ``boundary`` move."""
    return boundary.config.model_copy(update={"select": None, "until": None})


def log_obstructed(scene: Scene) -> None:
    """Log a warning if held vertices have targets inside an obstacle: contacts do not move them.

    If a hold begins in a later frame, its vertices are assumed to be at rest until then, except for
    corrections by obstacles.
    """
    obstacles = [contact for contact in scene.contacts if contact.each_alone]
    inside, blocked = np.zeros(scene.mesh.vertices, dtype=bool), dict[str, None]()
    anchors: base.Anchors = ()
    positions = scene.mesh.points.copy()
    slack = SLACK * scene.mesh.extent
    for frame in range(scene.config.frames if obstacles and scene.boundaries else 0):
        one = range(frame, frame + 1)
        held, (targets,), anchors = base.held_path(scene.boundaries, one, positions, anchors)
        positions[held] = targets
        for obstacle in obstacles:
            obstacle.correct(positions, positions.copy())
            pushed = held[np.linalg.norm(positions[held] - targets, axis=1) > slack]
            positions[held] = targets
            if len(pushed):
                inside[pushed], blocked[obstacle.name] = True, None
    vertices = np.flatnonzero(inside)
    if len(vertices):
        more = ", ..." if len(vertices) > NAMED else ""
        log.warning(
            "scene '%s': %d held vertices have targets inside '%s' and stay there: %s%s",
            scene.config.name, len(vertices), "', '".join(blocked),
            ", ".join(map(str, vertices[:NAMED])), more,
        )  # fmt: skip
