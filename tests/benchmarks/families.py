"""Scenes of the benchmarks: one a family and size, deformed as in the middle of a run."""

import numpy as np

from pdrom.model.scene import Scene, SceneConfig
from places import ROOT

WEIGHTS = {
    "bending": 1e-2,
    "spring": 1e5,
    "strain": 1e5,
    "deformation_gradient": 1e8,
    "tetrahedron_strain": 1e6,
}


def sheet(size: int, *groups: str, wave: float = 0.0) -> Scene:
    """Horizontal sheet of ``size`` x ``size`` vertices, held on the left, under gravity."""
    mesh = {"kind": "cloth", "rows": size, "columns": size, "plane": "xz", "wave": wave}
    return _scene(groups, mesh)


def bar(nx: int, ny: int, nz: int, group: str) -> Scene:
    """Bar of nx x ny x nz vertices, held on the left, under gravity."""
    return _scene((group,), {"kind": "bar", "nx": nx, "ny": ny, "nz": nz})


def _scene(groups: tuple[str, ...], mesh: dict) -> Scene:
    held = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]
    effects = [{"effect": group, "weight": WEIGHTS[group]} for group in groups]
    config = SceneConfig.model_validate(
        {"name": "benchmark", "title": "", "mesh": mesh, "frames": 1, "effects": held + effects}
    )
    return Scene.build(config, config.mesh.build(ROOT))


FAMILIES = {
    "springs 20x20": lambda: sheet(20, "spring"),
    "springs 100x100": lambda: sheet(100, "spring"),
    "strain 20x20": lambda: sheet(20, "strain"),
    "strain 100x100": lambda: sheet(100, "strain"),
    "bending 20x20": lambda: sheet(20, "bending", wave=0.1),
    "three groups 100x100": lambda: sheet(100, "bending", "spring", "strain"),
    "bar 40x5x5 rotations": lambda: bar(40, 5, 5, "deformation_gradient"),
    "bar 40x5x5 clamped": lambda: bar(40, 5, 5, "tetrahedron_strain"),
    "bar 80x10x10 rotations": lambda: bar(80, 10, 10, "deformation_gradient"),
    "bar 80x10x10 clamped": lambda: bar(80, 10, 10, "tetrahedron_strain"),
}

# scenes of one group that fit into the caches
KERNELS = [name for name in FAMILIES if "20x20" in name or "40x5x5" in name]


def twisted(points: np.ndarray, turn: float = 1.5) -> np.ndarray:
    """Points turned about x by up to ``turn`` radians and stretched by 5 %, with a small noise.

    Hardly any element is left in its range, so that every one is projected.
    """
    angle = turn * (points[:, 0] - points[:, 0].min()) / np.ptp(points[:, 0])
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = (1.05 * points).T
    noise = np.random.default_rng(1).standard_normal(points.shape)
    return np.column_stack([x, c * y - s * z, s * y + c * z]) + 1e-4 * noise
