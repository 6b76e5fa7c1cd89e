"""Builders of small scenes."""

from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

from pdrom.core import store
from pdrom.model.constraints.local_kernel import call_gradients
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene, SceneConfig
from places import ROOT

GROUPS = {
    "bending": {"kind": "cloth", "rows": 7, "columns": 6, "wave": 0.1},
    "spring": {"kind": "cloth", "rows": 6, "columns": 5},
    "strain": {"kind": "cloth", "rows": 6, "columns": 5},
    "tetrahedron_strain": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "deformation_gradient": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "volume": {"kind": "bar", "nx": 5, "ny": 3, "nz": 3},
    "area": {"kind": "cloth", "rows": 6, "columns": 5},
}
OBSTACLES = {
    "plane": {"point": [0.1, 0.2, 0.3], "normal": [1, 2, -2]},
    "sphere": {"centre": [0.1, 0.2, 0.3], "radius": 0.7},
    "box": {"lower": [-0.4, -0.5, -0.6], "upper": [0.7, 0.6, 0.5]},
}
GRAVITY = {"effect": "gravity"}
LEFT = {"effect": "pins", "select": "left"}
TOP = {"effect": "pins", "select": "top"}
# Scene file of a small sheet, for commands.
SMALL = """\
name: small
title: Small
frames: 12
mesh: {kind: cloth, rows: 6, columns: 5, plane: xz}
effects:
  - {effect: gravity}
  - {effect: pins, select: left}
  - {effect: spring, weight: 1.0e+5}
"""


def make_scene(
    *effects: dict, mesh: dict | None = None, frames: int = 20, **settings: object
) -> Scene:
    """Scene of the given effects on a small mesh."""
    keys = {"name": "test", "title": "test", "mesh": mesh or GROUPS["spring"], "frames": frames}
    config = SceneConfig.model_validate({**keys, "effects": list(effects), **settings})
    return Scene.build(config, config.mesh.build(ROOT))


def with_effects(scene: Scene, *effects: dict) -> Scene:
    further = make_scene({"effect": "spring", "weight": 1.0}, *effects).config.effects[1:]
    return scene.changed(effects=(*scene.config.effects, *further))


def frame(header: str, *rows: tuple) -> pd.DataFrame:
    """Data frame of the rows, with the columns that a header names."""
    return pd.DataFrame(list(rows), columns=header.split())


def write_result(path: Path, value: float = 0.1) -> None:
    """Write a small result that contains the value, in the format of its file name."""
    if path.suffix == ".h5":
        with store.write_hdf5(path) as file:
            file["x"] = np.linspace(0.0, value, 64)
            file["x"].attrs["unit"] = "m"
            file["group/y"] = np.arange(30)
    elif path.suffix == ".csv":
        store.write_table(frame("scene error", ("a", value), ("b", np.nan), ("c", 1e-300)), path)
    else:
        store.write_text(f"\\newcommand{{\\val}}{{{value}}}\n" * 3, path)


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """Uniformly distributed rotation (3, 3)."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


class Pushing:
    """A local step that adds the value of ``draw`` in each call: (N, 3) N, or a number."""

    def __init__(self, draw, name: str = "spring") -> None:
        self.draw, self.name = draw, name

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze nothing."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        rhs += self.draw()
        return float("nan")


@njit
def call_kernel(address, d, parameters, p, m):
    """Call the compiled kernel at ``address`` for ``m`` elements, which writes into p."""
    call_gradients(address, d.ctypes.data, parameters.ctypes.data, p.ctypes.data, m)


def depths(contact, points: np.ndarray) -> np.ndarray:
    """Depths (n,) m of ``points`` (n, 3) m below the surface of a floor or an obstacle."""
    return contact.depths(points) if contact.height is None else contact.height - points[:, 1]


def simplices(rows: int, count: int) -> Mesh:
    """``count`` separate unit simplices with ``rows`` + 1 vertices.

    Their S q is F^T, so that a test can choose F freely.
    """
    corners = np.eye(4, 3, k=-1)[: rows + 1]
    cells = np.arange(count * (rows + 1), dtype=np.int32).reshape(count, rows + 1)
    points = np.tile(corners, (count, 1))
    if rows == 3:
        return Mesh(points, np.empty((0, 3), dtype=np.int32), cells)
    return Mesh(points, cells)


def bound(kind: type, rows: int, count: int, **settings: float):
    mesh = simplices(rows, count)
    return kind(kind.Config(weight=1.0, **settings), mesh, np.ones(mesh.vertices))


def projected(group, f: np.ndarray) -> np.ndarray:
    """Projections (e, rows, 3) of the group's elements at F^T = f."""
    y = np.concatenate([np.zeros((len(f), 1, 3)), f], axis=1).reshape(-1, 3)
    return group.project(y).reshape(f.shape)


def perturbed_runs() -> pd.DataFrame:
    """Differences of perturbed runs: scene a exceeds 1e-3 in frame 2 (test run: 1), b never."""
    values = {
        ("a", "1e-10", 1): [0.0, 1e-9, 5e-3, 1e-9],
        ("a", "1e-10", 2): [0.0, 2e-9, 1e-9, 1.0],
        ("a", "1e-06", 1): [1.0] * 4,
        ("a", "heldout", 1): [1e-12, 1.0, 1.0, 1.0],
        ("b", "1e-10", 1): [1e-12, 3e-12, 2e-12, 1e-12],
        ("b", "heldout", 1): [1e-12] * 4,
    }
    rows = [(*key, number, v) for key, own in values.items() for number, v in enumerate(own)]
    return frame("scene perturbation seed frame relative_difference", *rows)
