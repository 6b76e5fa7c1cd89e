"""Build the scenes of config/hard_cases.yaml, which have extreme meshes, states or settings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np

from pdrom.core import config_file
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.model.dynamics.stepper import State
from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.generators import bar, boundary, cloth
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene, SceneConfig

# Files in config that the experiment declares as its inputs: the list of cases, and meshes.
LIST, *FILES = (
    "hard_cases.yaml", "scenes/meshes/hard_disc.obj", "scenes/meshes/hard_starfish_shell.obj",
    "scenes/meshes/hard_starfish.vtu", "scenes/meshes/hard_torus.vtu",
)  # fmt: skip
SEED = 7


@dataclass(frozen=True)
class HardCase:
    """An entry of config/hard_cases.yaml: a scene, and the reason (``why``) that makes it hard.

    mesh : name of a mesh in `MESHES`
    start : arguments of `start_of`
    bound : largest extent (longest side of the bounding box) that tests allow for the full-order
        run, relative to the largest extent of start, rest shape and fixed vertices
    uneven : True: masses span eight decades, in random order
    settings : further keys of the scene
    """

    why: str
    mesh: str
    effects: list[dict[str, Any]]
    start: dict[str, Any] = field(default_factory=dict)
    bound: float = 2.0
    uneven: bool = False
    settings: dict[str, Any] = field(default_factory=dict)

    def scene(self) -> Scene:
        """Build the scene; raises PdromError if the scene is refused."""
        mesh, masses = MESHES[self.mesh](), None
        if self.uneven:
            order = np.random.default_rng(3).permutation(mesh.vertices)
            masses = np.logspace(-4, 4, mesh.vertices)[order]
        return build(mesh, *self.effects, masses=masses, **self.settings)


@cache
def cases() -> dict[str, HardCase]:
    """Map names to all hard cases; ConfigurationError if their file cannot be read."""
    listed, found = read_yaml(config_file(LIST)), {}
    for name, keys in listed["cases"].items():
        own = {key: keys.pop(key) for key in HardCase.__dataclass_fields__ if key in keys}
        own["effects"] = [listed["effects"].get(str(e), e) for e in own["effects"]]
        found[name] = HardCase(**own, settings=keys)
    return found


def build(
    mesh: Mesh, *effects: dict[str, Any], frames: int = 30, masses: np.ndarray | None = None,
    **settings: Any,
) -> Scene:  # fmt: skip
    """Build a scene of ``effects`` on ``mesh``; ``settings`` are keys of `SceneConfig`.

    ``masses`` are (N,) in kg; without them, all vertices have the same mass.
    """
    named = {"name": "hard_case", "title": "hard case"}
    own = {"mesh": {"kind": "file", "path": "generated"}, "frames": frames, **settings}
    config = validate(SceneConfig, {**named, **own, "effects": list(effects)}, "hard case")
    return Scene.build(config, mesh, masses=masses)


def start_of(
    scene: Scene, mapped: list[Any] | None = None, scrambled: float | None = None,
    merged: bool = False, folded: bool = False, noise: float = 0.0, raised: float = 0.0,
    falling: float = 0.0, meeting: float = 0.0,
) -> State:  # fmt: skip
    """Return the state in which a hard case begins: the rest shape, changed by each argument.

    mapped : matrix (3, 3), or its diagonal (3,), that maps positions about their centre
    scrambled : side of a cube of random positions, relative to the longest side of the mesh
    merged : every odd vertex is at the place of the vertex before it
    folded : the half with larger x is mirrored onto the half with smaller x
    noise : standard deviation of noise in all coordinates, relative to the longest side
    raised : shift along y, m
    falling : speed of all vertices downwards, m/s
    meeting : speed downwards of vertices above the mean height, upwards of the others, m/s
    """
    q, extent, start = scene.mesh.points.copy(), scene.mesh.extent, scene.initial_state()
    v, centre = start.velocities.copy(), q.mean(axis=0)
    if mapped is not None:
        matrix = np.array(mapped)
        q = centre + (q - centre) @ (matrix.T if matrix.ndim == 2 else np.diag(matrix))
    if scrambled is not None:
        box = np.random.default_rng(SEED).uniform(-0.5, 0.5, q.shape)
        q = centre + scrambled * extent * box
    if merged:
        q[1::2] = q[: len(q) - len(q) % 2 : 2]
    if folded:
        middle = 0.5 * (q[:, 0].min() + q[:, 0].max())
        q[:, 0] = middle - np.abs(q[:, 0] - middle)
    if noise:
        q = q + noise * extent * np.random.default_rng(SEED).standard_normal(q.shape)
    if raised:
        q[:, 1] += raised
    v[:, 1] -= falling + np.where(q[:, 1] > q[:, 1].mean(), meeting, -meeting)
    return State(q, v, start.anchors)


def _changed(make: Callable[[], Mesh], factors: Any, offset: Any = (0.0, 0.0, 0.0)) -> Mesh:
    mesh = make()
    points = mesh.points * np.array(factors) + np.array(offset)
    return Mesh(points, mesh.triangles, mesh.tetrahedra)


def _two_sheets(*offset: float) -> Mesh:
    """Make two sheets that are not connected; the second is moved by ``offset`` (x, y, z), m."""
    first, second = _sheet(), _changed(_sheet, 1.0, offset)
    cells = np.concatenate([first.triangles, second.triangles + first.vertices]).astype(np.int32)
    return Mesh(np.concatenate([first.points, second.points]), cells)


def _one_sliver() -> Mesh:
    """Make a bar with one vertex moved almost into the opposite face of a tetrahedron."""
    mesh = _bar()
    points = mesh.points.copy()
    corners = points[mesh.tetrahedra[1]]
    centroid = corners[1:].mean(axis=0)
    points[mesh.tetrahedra[1, 0]] = centroid + 1e-6 * (corners[0] - centroid)
    return Mesh(points, mesh.triangles, mesh.tetrahedra)


def _simplex(size: int) -> Mesh:
    """Make a single triangle (``size`` 3) or tetrahedron (4)."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])[:size]
    cells = np.arange(size, dtype=np.int32)[None]
    return Mesh(points, cells) if size == 3 else Mesh(points, boundary(cells), cells)


_bar, _sheet = partial(bar, 5, 3, 3), partial(cloth, 6, 6, "xz")
_wavy = partial(_sheet, wave=0.05)
MESHES: dict[str, Callable[[], Mesh]] = {
    "sheet": _sheet,
    "wavy sheet": _wavy,
    "wavier sheet": partial(_sheet, wave=0.1),
    "bar": _bar,
    "triangle": partial(_simplex, 3),
    "tetrahedron": partial(_simplex, 4),
    "needles": partial(_changed, _wavy, (1.0, 1e-4, 1e-4)),
    "slivers": partial(_changed, _bar, (1.0, 1.0, 1e-6)),
    "one sliver": _one_sliver,
    "tiny bar": partial(_changed, _bar, 1e-6),
    "huge bar": partial(_changed, _bar, 1e6),
    "far sheet": partial(_changed, _sheet, 1.0, (1e9, 0.0, 0.0)),
    "sheets apart": partial(_two_sheets, 3.0, 0.5, 0.0),
    "sheets in layers": partial(_two_sheets, 0.0, 0.5, 0.0),
    **{
        name: partial(read_mesh_file, config_file(file).resolve())
        for name, file in zip(("disc", "starfish shell", "starfish", "torus"), FILES, strict=True)
    },
}
