"""Measure how full-order runs change with small perturbations or other settings (docs/study.md).

A run whose start is moved by 1e-10 of the mesh's size differs from the unchanged run. No reduced
model can be expected to have a smaller error. Further runs have another linear solver (order of
summation), number of iterations or time step, or lack an effect. Forces of effects are recorded.
"""

from collections.abc import Iterator
from typing import Annotated, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.effects.base import Contact, Effect, Force, Seed
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import mean_motion
from study.artifact.paths import CONTRIBUTIONS, FULL_ORDER, MESH, SENSITIVITY, File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit

EFFECTS = ["scene", "effect", "role", "frame", "force", "energy"]
Row = tuple[str, str, int, float, float]
COLUMNS = ["scene", "perturbation", "seed", "frame", "relative_difference"]
OTHER_SOLVER = "splu"  # a linear solver that sums in another order than the default solver


class PerturbedRuns(ConfigModel):
    """Settings of runs from randomly moved initial positions, for all ``seeds``.

    ``perturbations`` are lengths of the displacement relative to the longest side of the mesh. The
    perturbation ``reference`` defines the horizon; test trajectories are run with it only.
    """

    perturbations: tuple[kit.Tolerance, ...] = (1e-12, 1e-10, 1e-8)
    reference: kit.Tolerance = 1e-10
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1, 2, 3)

    @model_validator(mode="after")
    def _reference_is_run(self) -> Self:
        if self.reference not in self.perturbations:
            raise ValueError(f"reference = {self.reference}: must be one of the perturbations")
        return self


class Sensitivity(PerturbedRuns):
    """Section ``sensitivity``; runs are compared until perturbed runs differ by ``threshold``."""

    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1e-3


@kit.experiment(
    "Perturbed full-order runs of {scene}",
    reads={
        "mesh": MESH,
        "full_order": Every(FULL_ORDER),
        "config": Setting("scene"),
        "chosen": Setting("sensitivity"),
    },
    writes={"out": SENSITIVITY, "effects": CONTRIBUTIONS},
)
def sensitivity(
    mesh: File, full_order: list[File], config: SceneConfig, chosen: PerturbedRuns, out: File,
    effects: File,
) -> None:  # fmt: skip
    """Run training and test trajectories from perturbed starts; also vary the scene's settings.

    Differences from unchanged runs go to ``out``, forces and energies of effects to ``effects``.
    """
    parts: list[pd.DataFrame] = []
    for run in full_order:  # each trajectory has another horizon
        motion, base = run["run"], kit.positions_of(run)
        scene = kit.scene_of(config, mesh, motion)
        if motion == kit.TRAIN:
            parts.append(sensitivities(scene, base, chosen.perturbations, chosen.seeds))
            write_table(contributions(scene), effects.path)
        else:
            parts += perturbed(scene, base, chosen.reference, chosen.seeds, motion)
    write_table(pd.concat(parts, ignore_index=True), out.path)


class _Watched:
    """Wrapper of a contact that records how far the contact moves each vertex in a frame."""

    def __init__(self, contact: Contact) -> None:
        self.name, self._contact = contact.name, contact
        self.moved = np.zeros(())

    def apply(self, positions: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        """Apply the contact to ``positions``; store its displacement of each vertex in `moved`."""
        wanted = positions.copy()
        self._contact.apply(positions, before, held)
        self.moved = positions - wanted


def contributions(scene: Scene) -> pd.DataFrame:
    """Tabulate the norm of the force (N) and the energy (J) of each effect in each frame.

    Effects with the same name are added. A frame of h seconds leads from positions q and velocities
    v to positions q'; M are the masses (other symbols: docs/study.md). The force on free vertices
    is S^T W (p - S q') for a constraint group, M a for an acceleration a, and M d / h^2 for a
    contact that moves vertices by d. Pins and handles exert M (q' - q - h v) / h^2, minus the
    forces of groups and accelerations, on the vertices that they hold; initial velocities v exert
    M v / h. The energy is that of the constraints, the potential of a force, or the kinetic energy
    of initial velocities; it is nan for other effects.
    """
    watched = [_Watched(contact) for contact in scene.contacts]
    space = VertexSpace(scene.system, scene.forces, scene.boundaries, contacts=watched)  # type: ignore[arg-type]
    config = scene.config
    loop = Stepper(
        space, config.time_step, config.count, local_steps=scene.groups, track_objective=False,
        acceleration=scene.acceleration(),
    )  # fmt: skip
    state, rows = scene.initial_state(), []
    for start in scene.starts:
        v, m = start.velocity(), scene.masses[:, None]
        force = float(np.linalg.norm(m * v)) / config.time_step
        rows.append((start.name, "start", 0, force, 0.5 * float(np.sum(m * v**2))))
    for frame in range(config.frames):
        after, _ = loop.step(state, frame)
        rows += _frame(scene, loop, watched, state, after, frame)
        state = after
    return pd.DataFrame([(config.name, *row) for row in rows], columns=EFFECTS)


def _frame(
    scene: Scene, loop: Stepper, watched: list[_Watched], before: State, after: State, frame: int
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

    for group in map(loop.local_step, scene.config.groups):  # prepared for ``frame`` by `step`
        missing = group.project(after.positions) - group.S @ after.positions
        weighted = group.row_weights[:, None] * missing
        energy = 0.5 * float(np.sum(missing * weighted))
        add(group, "constraint group", group.S.T @ weighted, energy)
    for force in scene.forces:
        pull = m * force.acceleration(before.positions, before.velocities)
        own = force.potential(after.positions, scene.masses)
        conserves = type(force).potential is not Force.potential
        add(force, "force", pull, own if conserves else np.nan)
    needed = m * (after.positions - before.positions - h * before.velocities) / h**2
    lacking = needed - sum(forces.values())
    for contact in watched:
        add(contact, "contact", m * contact.moved / h**2, np.nan)
    rows = [
        (name, role, frame, float(np.linalg.norm(force[~held])), energies[name])
        for (name, role), force in forces.items()
    ]
    squares: dict[str, float] = {}  # name of a pin or handle -> squared force, 0 if inactive
    for boundary in scene.boundaries:
        pulled = lacking[boundary.held(frame)] if boundary in active else np.zeros(3)
        squares[boundary.name] = squares.get(boundary.name, 0.0) + float(np.sum(pulled**2))
    holds = [(name, "hold", frame, np.sqrt(total), np.nan) for name, total in squares.items()]
    return [*rows, *holds]


def relative_difference(other: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the relative difference (F,) of trajectory ``other`` from ``base`` in each frame.

    Both have the shape (F + 1, N, 3). The difference is || Q'_f - Q_f ||_F in frame f, divided by
    the root mean square of || Q_f - Q_0 ||_F of ``base`` over all frames. A common denominator
    avoids division by almost zero in slow first frames.
    """
    difference = (other - base)[1:].reshape(len(base) - 1, -1)
    return np.linalg.norm(difference, axis=1) / mean_motion(base)


def perturbed(
    scene: Scene, base: np.ndarray, size: float, seeds: tuple[int, ...], label: str
) -> Iterator[pd.DataFrame]:
    """Yield rows of runs from initial positions moved at random, one table for each seed.

    Displacements are ``size`` times the longest side of the mesh. ``base`` (F + 1, N, 3) m is the
    unperturbed run; column ``perturbation`` has the value ``label``.
    """
    for seed in seeds:
        other = trajectory(scene, kit.perturbation_field(scene, size, seed))
        yield _rows(scene, label, seed, relative_difference(other, base))


def sensitivities(
    scene: Scene, base: np.ndarray, perturbations: tuple[float, ...], seeds: tuple[int, ...]
) -> pd.DataFrame:
    """Tabulate by frame the relative differences of perturbed and changed runs from ``base``.

    ``base`` (F + 1, N, 3) m are the positions in the run of ``scene``.

    The changes are another solver, four times the iterations, half the time step, and the scene
    without all effects of one name (unless it would have no constraint group left).
    """
    config = scene.config
    parts: list[pd.DataFrame] = []
    for size in perturbations:
        parts += perturbed(scene, base, size, seeds, f"{size:g}")
    halved = scene.changed(
        time_step=0.5 * config.time_step,
        frames=2 * config.frames,
        effects=tuple(e.with_frames_scaled(2.0) for e in config.effects),
    )
    variants = {
        "solver": trajectory(scene, system=scene.system_with(OTHER_SOLVER)),
        "iterations x4": trajectory(scene.changed(iterations=4 * config.count)),
        # building the scene again checks that there are not too many frames
        "h/2": trajectory(Scene.build(halved.config, halved.mesh))[::2],
    }
    for effect in removable(config):
        left = scene.changed(effects=config.effects_without(effect))
        variants[without(effect)] = trajectory(left)
    for label, other in variants.items():
        parts.append(_rows(scene, label, 0, relative_difference(other, base)))
    return pd.concat(parts, ignore_index=True)


def without(effect: str) -> str:
    """Return the text in the column ``perturbation`` for runs without ``effect``."""
    return f"without {effect}"


def removable(config: SceneConfig) -> list[str]:
    """List the effects without which a scene can run: all except its only constraint group."""
    names = dict.fromkeys(e.effect for e in config.effects)
    return [name for name in names if config.groups != [name]]


def _rows(scene: Scene, label: str, seed: int, values: np.ndarray) -> pd.DataFrame:
    row = (scene.config.name, label, seed, np.arange(len(values)), values)
    return pd.DataFrame(dict(zip(COLUMNS, row, strict=True)))
