"""Drift of runs of a scene that should be the same, and what its effects do in it."""

from collections.abc import Iterable
from typing import Annotated, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.effects.base import Boundary, Contact, Effect, Force, Seed
from pdrom.model.held_out import MOTIONS
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.paths import CONTRIBUTIONS, MESH, SENSITIVITY, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.sensitivity import heldout_floor, sensitivities

Perturbation = Annotated[float, Field(gt=0.0, lt=1.0)]
COLUMNS = ["scene", "effect", "role", "frame", "force", "energy"]
Row = tuple[str, str, int, float, float]


class PerturbedRuns(ConfigModel):
    """Starts moved by ``perturbations`` times the extent, each with every seed.

    ``reference`` is the perturbation that defines the horizon, and that of held-out motions.
    """

    perturbations: tuple[Perturbation, ...] = (1e-12, 1e-10, 1e-8)
    reference: Perturbation = 1e-10
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1, 2, 3)

    @model_validator(mode="after")
    def _reference_is_run(self) -> Self:
        if self.reference not in self.perturbations:
            raise ValueError(f"reference = {self.reference}: must be one of the perturbations")
        return self


class Sensitivity(PerturbedRuns):
    """Section ``sensitivity``: ``threshold`` is the relative difference that ends the horizon."""

    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1e-3


@experiment(
    "Perturbed full-order runs of {scene}",
    reads={"mesh": MESH, "config": Setting("scene"), "chosen": Setting("sensitivity")},
    writes={"out": SENSITIVITY, "effects": CONTRIBUTIONS},
)
def sensitivity(
    mesh: File, config: SceneConfig, chosen: PerturbedRuns, out: File, effects: File
) -> None:
    """Write differences of a scene's perturbed runs, and of its held-out motions, to ``out``."""
    scene = scene_of(config, mesh)
    table = sensitivities(scene, chosen.perturbations, chosen.seeds)
    heldout = [
        heldout_floor(scene_of(config, mesh, motion), motion, chosen.reference, chosen.seeds)
        for motion in MOTIONS
    ]
    write_table(pd.concat([table, *heldout], ignore_index=True), out.path)
    write_table(contributions(scene), effects.path)


class _Watched:
    """Stands for a contact and remembers how far it moved the vertices in a frame."""

    def __init__(self, contact: Contact) -> None:
        self.name, self._contact = contact.name, contact
        self.moved = np.zeros(())

    def apply(self, positions: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        """Apply the contact and record what it moves."""
        wanted = positions.copy()
        self._contact.apply(positions, before, held)
        self.moved = positions - wanted


def contributions(scene: Scene) -> pd.DataFrame:
    """Table of `COLUMNS` of a run of ``scene``: force (norm, N) and energy (J) by effect and frame.

    Effects with the same name count as one. Forces are those at the end of a frame, on the vertices
    that nothing holds: S^T W (p - S q) of a group, M a of a force, M d / h^2 of a contact that
    moves the vertices by d. A hold exerts what its vertices lack, M (q' - q - h v) / h^2 less all
    others; a start M v / h in the first frame.

    The energy of a group is W_j, that of a force its potential, with an arbitrary zero, and that
    of a start the kinetic energy that it brings. Where an effect has none it is nan.
    """
    watched = [_Watched(contact) for contact in scene.contacts]
    space = VertexSpace(scene.system, scene.forces, scene.boundaries, contacts=watched)  # type: ignore[arg-type]
    config = scene.config
    loop = Stepper(
        space, config.time_step, config.iterations, local_steps=scene.groups, track_objective=False,
        acceleration=scene.acceleration(),
    )  # fmt: skip
    state, rows = scene.initial_state(), []
    rows += _starts(scene)
    for frame in range(config.frames):
        after, _ = loop.step(state, frame)
        rows += _frame(scene, watched, state, after, frame)
        state = after
    return pd.DataFrame([(config.name, *row) for row in rows], columns=COLUMNS)


def _starts(scene: Scene) -> list[Row]:
    rows = []
    for start in scene.starts:
        v, m = start.velocity(), scene.masses[:, None]
        force = float(np.linalg.norm(m * v)) / scene.config.time_step
        rows.append((start.name, "start", 0, force, 0.5 * float(np.sum(m * v**2))))
    return rows


def _frame(
    scene: Scene, watched: list[_Watched], before: State, after: State, frame: int
) -> list[Row]:
    h, m = scene.config.time_step, scene.masses[:, None]
    active = [b for b in scene.boundaries if b.active(frame)]
    held = np.zeros(scene.mesh.vertices, dtype=bool)
    for boundary in active:
        held[boundary.held(frame)] = True
    forces: dict[tuple[str, str], np.ndarray] = {}
    energies: dict[str, float] = {}

    def add(effect: Effect | _Watched, role: str, force: np.ndarray, energy: float) -> None:
        key = effect.name, role
        forces[key] = forces.get(key, 0.0) + np.broadcast_to(force, after.positions.shape)
        energies[effect.name] = energies.get(effect.name, 0.0) + energy

    for group in scene.groups:
        add(group, "constraint group", *_of_group(group, after.positions))
    for force in scene.forces:
        pull = m * force.acceleration(before.positions, before.velocities)
        own = force.potential(after.positions, scene.masses)
        add(force, "force", pull, own if _conserves(force) else np.nan)
    needed = m * (after.positions - before.positions - h * before.velocities) / h**2
    lacking = needed - sum(forces.values())
    for contact in watched:
        add(contact, "contact", m * contact.moved / h**2, np.nan)
    rows = [
        (name, role, frame, float(np.linalg.norm(force[~held])), energies[name])
        for (name, role), force in forces.items()
    ]
    return [*rows, *_holds(scene.boundaries, active, lacking, frame)]


def _of_group(group: ConstraintGroup, q: np.ndarray) -> tuple[np.ndarray, float]:
    """Force (N, 3) N and energy J of a group at q; what is frozen is that of the last frame."""
    missing = group.project(q) - group.S @ q
    weighted = group.row_weights[:, None] * missing
    return group.S.T @ weighted, 0.5 * float(np.sum(missing * weighted))


def _conserves(force: Force) -> bool:
    """Whether a force has a potential of its own."""
    return type(force).potential is not Force.potential


def _holds(
    boundaries: Iterable[Boundary], active: list[Boundary], lacking: np.ndarray, frame: int
) -> list[Row]:
    """One row for each name; a hold that is not active exerts nothing."""
    squares: dict[str, float] = {}
    for boundary in boundaries:
        own = lacking[boundary.held(frame)] if boundary in active else np.zeros(3)
        squares[boundary.name] = squares.get(boundary.name, 0.0) + float(np.sum(own**2))
    return [(name, "hold", frame, np.sqrt(total), np.nan) for name, total in squares.items()]
