"""A hard case: a scene, the properties its run must have, and states to start from."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdrom.core.yamlfile import validate
from pdrom.model.dynamics.stepper import State
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene, SceneConfig

Start = Callable[[Scene], State]
Shape = Callable[[], Mesh]
SEED = 7


@dataclass(frozen=True)
class HardCase:
    """A scene that is hard for a named reason, and the properties that its run must have.

    why : what makes the scene hard
    holds : names of the checks that the full-order run must pass (`record.CHECKS`); a case with
        "refused" alone raises an error when its scene is built or run
    mesh, effects, settings : arguments of `build`; the mesh as a function
    start : the state before the first frame
    bound : largest extent that is no blow-up, over the largest extent of start, rest and handles
    slow : whether only the slow tests run the case
    """

    name: str
    why: str
    holds: tuple[str, ...]
    mesh: Shape
    effects: tuple[dict[str, Any], ...]
    settings: dict[str, Any]
    start: Start = Scene.initial_state
    bound: float = 2.0
    slow: bool = False

    def scene(self) -> Scene:
        """Build the scene; PdromError if it is refused."""
        return build(self.mesh(), *self.effects, **self.settings)


def build(
    mesh: Mesh,
    *effects: dict[str, Any],
    frames: int = 30,
    masses: Callable[[Mesh], np.ndarray] | None = None,
    **settings: Any,
) -> Scene:
    """Return a scene of ``effects`` on ``mesh``.

    ``masses`` maps a mesh to masses (N,) kg, equal by default; ``settings`` are keys of
    `SceneConfig`.
    """
    named = {"name": "hard_case", "title": "hard case"}
    own = {"mesh": {"kind": "file", "path": "generated"}, "frames": frames, **settings}
    config = validate(SceneConfig, {**named, **own, "effects": list(effects)}, "hard case")
    return Scene.build(config, mesh, masses=None if masses is None else masses(mesh))


def still(positions: np.ndarray) -> State:
    """A state at ``positions`` (N, 3) without velocity."""
    return State(positions, np.zeros_like(positions))


def mapped(*rows: tuple[float, float, float]) -> Start:
    """Rest shape under the linear map with these three ``rows`` about its centre, at rest."""

    def start(scene: Scene) -> State:
        points = scene.mesh.points
        centre = points.mean(axis=0)
        return still(centre + (points - centre) @ np.array(rows).T)

    return start


def scales(x: float, y: float, z: float) -> Start:
    """The rest shape scaled by ``x``, ``y``, ``z`` about its centre (negative: mirrored)."""
    return mapped((x, 0, 0), (0, y, 0), (0, 0, z))


def scrambled(size: float = 1.0) -> Start:
    """Vertices at random in a box of ``size`` rest extents."""

    def start(scene: Scene) -> State:
        points = scene.mesh.points
        box = np.random.default_rng(SEED).uniform(-0.5, 0.5, points.shape)
        return still(points.mean(axis=0) + size * scene.mesh.extent * box)

    return start


def noisy(start: Start, size: float) -> Start:
    """``start`` with normal noise of ``size`` rest extents."""

    def moved(scene: Scene) -> State:
        noise = np.random.default_rng(SEED).standard_normal(scene.mesh.points.shape)
        return still(start(scene).positions + size * scene.mesh.extent * noise)

    return moved


def pairs_merged(scene: Scene) -> State:
    """Every odd vertex of ``scene`` lies on the vertex before it: edges of length zero."""
    points = scene.mesh.points.copy()
    points[1::2] = points[: len(points) - len(points) % 2 : 2]
    return still(points)


def folded(scene: Scene) -> State:
    """The half x > 0 of ``scene`` lies on the half x < 0: vertices of its elements coincide."""
    points = scene.mesh.points.copy()
    centre = 0.5 * (points[:, 0].min() + points[:, 0].max())
    points[:, 0] = centre - np.abs(points[:, 0] - centre)
    return still(points)


def falling(speed: float) -> Start:
    """The rest shape, all vertices moving down at ``speed``, m/s."""
    return lambda scene: _vertical(scene, np.full(len(scene.mesh.points), -speed))


def meeting(speed: float) -> Start:
    """The upper half of the vertices moves down and the lower half up at ``speed``, m/s."""

    def start(scene: Scene) -> State:
        y = scene.mesh.points[:, 1]
        return _vertical(scene, np.where(y > y.mean(), -speed, speed))

    return start


def _vertical(scene: Scene, speeds: np.ndarray) -> State:
    points = scene.mesh.points.copy()
    velocities = np.zeros_like(points)
    velocities[:, 1] = speeds
    return State(points, velocities)


def lowered(offset: float) -> Start:
    """The rest shape moved by ``offset`` along y."""
    return lambda scene: still(scene.mesh.points + np.array([0.0, offset, 0.0]))
