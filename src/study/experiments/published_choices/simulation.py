"""The full-order run of a scene with choices of the published code."""

from collections.abc import Set
from functools import partial

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup, GroupConfig
from pdrom.model.dynamics.stepper import LocalStep, Stepper
from pdrom.model.effects.base import EffectConfig
from pdrom.model.effects.floor import Floor
from pdrom.model.effects.hold import Pins
from pdrom.model.mesh.config import BarMesh
from pdrom.model.mesh.generators import bar
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene
from study.experiments.kit.last_iterates import Look, last_iterates
from study.experiments.published_choices.choices import ALL, Choice
from study.experiments.published_choices.spaces import PublishedSpace

# Choices that act before a snapshot is stored; runs that agree in them are the same.
SIMULATION: frozenset[Choice] = frozenset(
    {"pins", "heavy", "stiffness", "floor", "mesh", "turns", "plane"}
)
# Elements whose volume changed by less than this factor, or its sign, are looked at one by one.
FLAT = 1e-6
# Places of a cell's five tetrahedra here in the order that they have there, for the two patterns.
_ORDER = {0: (3, 4, 1, 2, 0), 1: (1, 4, 3, 2, 0)}


def applicable(scene: Scene, group: ConstraintGroup) -> tuple[Choice, ...]:
    """Choices that can change anything for a ``group`` of ``scene``, in order."""
    flat = float(np.ptp(scene.mesh.points, axis=0).min()) == 0.0
    applies: dict[Choice, bool] = {
        "pins": flat and any(isinstance(held, Pins) for held in scene.boundaries),
        "heavy": not flat and any(isinstance(held, Pins) for held in scene.boundaries),
        "stiffness": any(g.name == "spring" for g in scene.groups),
        "floor": any(isinstance(contact, Floor) for contact in scene.contacts),
        "mesh": isinstance(scene.config.mesh, BarMesh),
        "turns": group.name == "deformation_gradient",
        "plane": group.name == "strain" and flat,
        "idle": flat,
        "rows": group.rows_per_element > 1,
    }
    return tuple(choice for choice in ALL if applies.get(choice, True))


def projections(scene: Scene, name: str, taken: Set[Choice]) -> tuple[np.ndarray, np.ndarray]:
    """Projections (F, e p, 3) of the last iterate of every frame, and weights (e p,) of the rows.

    They are those of group ``name`` in ``scene`` with the choices ``taken``; the weights are those
    of the choice "weighting".
    """
    changed = _changed(scene, taken)
    group = changed.group(name)
    _, seen = last_iterates(changed, _stepper(changed, group, taken), _look(group, taken))
    return np.stack(seen), row_sizes(group, changed.mesh)


def row_sizes(group: ConstraintGroup, mesh: Mesh) -> np.ndarray:
    """Sum of the areas or volumes of an element's vertices, for each of its rows (e p,), m2 or m3.

    The elements are those of ``group`` on ``mesh``. A vertex has a quarter of the tetrahedra around
    it, or the circumcentric area of a surface.
    """
    sizes = _volumes(mesh) if len(mesh.tetrahedra) else _areas(mesh)
    elements = sizes[group.element_vertices(mesh)].sum(axis=1)
    return np.repeat(elements, group.rows_per_element)


def _changed(scene: Scene, taken: Set[Choice]) -> Scene:
    config = scene.config
    effects = config.effects_without("pins") if "pins" in taken else config.effects
    if "stiffness" in taken:
        effects = tuple(_halved(effect) for effect in effects)
    mesh = scene.mesh
    if "mesh" in taken and isinstance(config.mesh, BarMesh):
        mesh = _bar(config.mesh)
    return Scene.build(config.model_copy(update={"effects": effects}), mesh)


def _halved(effect: EffectConfig) -> EffectConfig:
    """A spring with half its weight; other effects as they are."""
    if not isinstance(effect, GroupConfig) or effect.effect != "spring":
        return effect
    return effect.model_copy(update={"weight": 0.5 * effect.weight})


def _bar(config: BarMesh) -> Mesh:
    """The bar with the two patterns of cells exchanged, and their tetrahedra in another order."""
    mesh = bar(
        config.nx, config.ny, config.nz, extent=config.extent, lift=config.lift, exchanged=True
    )
    cells = np.indices((config.nx - 1, config.ny - 1, config.nz - 1)).reshape(3, -1)
    pattern = (cells.sum(axis=0) + 1) % 2
    order = np.array([_ORDER[0], _ORDER[1]])[pattern] + 5 * np.arange(len(pattern))[:, None]
    return Mesh(mesh.points, mesh.triangles, mesh.tetrahedra[order.ravel()])


def _stepper(scene: Scene, group: ConstraintGroup, taken: Set[Choice]) -> Stepper:
    steps: list[LocalStep] = list(scene.groups)
    if "turns" in taken:
        steps = [TurnedStep(g) if g is group else g for g in steps]
    space = PublishedSpace(scene, "floor" in taken, "heavy" in taken)
    config = scene.config
    return Stepper(
        space,
        config.time_step,
        config.iterations,
        local_steps=steps,
        track_objective=False,
        acceleration=scene.acceleration(),
    )


class TurnedStep:
    """Deformation gradients with the published code's rule for flat and inverted elements.

    With F = U D V^T their projection is U V^T as LAPACK returns it, its third column turned where
    the determinant is negative: a rotation, but not the nearest one, and where an element is flat
    the sign of the vanishing singular vector decides.
    """

    def __init__(self, group: ConstraintGroup) -> None:
        self.name, self._group = group.name, group

    def begin_frame(self, q: np.ndarray) -> None:
        """Begin a frame of the group at ``q`` (N, 3) m."""
        self._group.begin_frame(q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3); the energy is not known: nan."""
        group = self._group
        rhs += group.S.T @ (group.row_weights[:, None] * turned(group, y))
        return np.nan


def turned(group: ConstraintGroup, y: np.ndarray) -> np.ndarray:
    """Projections (e 3, 3) of ``group`` at ``y`` (N, 3) m by the rule of `TurnedStep`."""
    p = group.project(y)
    gradients = (group.S @ y).reshape(-1, 3, 3).transpose(0, 2, 1)
    folded = np.flatnonzero(np.linalg.det(gradients) < FLAT)
    u, _, vt = np.linalg.svd(gradients[folded])
    rotations = u @ vt
    rotations[np.linalg.det(rotations) < 0.0, :, 2] *= -1.0
    p.reshape(-1, 3, 3)[folded] = rotations.transpose(0, 2, 1)
    return p


def _look(group: ConstraintGroup, taken: Set[Choice]) -> Look:
    """Function of an iterate whose values are stored."""
    if "plane" in taken:
        return _in_rest_plane(group)
    return partial(turned, group) if "turns" in taken else group.project


def _in_rest_plane(group: ConstraintGroup) -> Look:
    """Projections of triangles whose deformation is first projected on the rest plane z = const."""

    def look(y: np.ndarray) -> np.ndarray:
        gradients = (group.S @ y).reshape(-1, group.rows_per_element, 3)
        gradients[:, :, 2] = 0.0
        return group.reference_project(gradients, np.arange(group.elements)).reshape(-1, 3)

    return look


def _volumes(mesh: Mesh) -> np.ndarray:
    corners = mesh.points[mesh.tetrahedra]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    return np.bincount(mesh.tetrahedra.ravel(), np.repeat(volumes / 4.0, 4), mesh.vertices)


def _areas(mesh: Mesh) -> np.ndarray:
    """Circumcentric areas (N,) of the vertices (Meyer et al. 2003, section 3.3)."""
    points = mesh.points[mesh.triangles]
    areas = np.zeros(mesh.vertices)
    for corner in range(3):
        here, left, right = (points[:, (corner + k) % 3] for k in range(3))
        to_left, to_right = left - here, right - here
        sine = np.linalg.norm(np.cross(to_left, to_right), axis=1)
        cotangent = np.einsum("ij,ij->i", to_left, to_right) / sine
        opposite = np.einsum("ij,ij->i", left - right, left - right)
        for k in (1, 2):
            np.add.at(areas, mesh.triangles[:, (corner + k) % 3], cotangent * opposite / 8.0)
    return areas
