"""Write tube.obj, dome.obj, arch.vtu and taper.vtu, grids that are mapped to other shapes.

`./reproduce run python config/scenes/meshes/mapped_grids.py FOLDER` writes them into FOLDER.
"""

import sys
from pathlib import Path

import meshio
import numpy as np

from pdrom.model.mesh.generators import bar, cloth


def tube(around: int = 24, along: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3) in m and triangles of a tube along x, closed around its axis."""
    sheet = cloth(along, around + 1, "xz", lift=0.0)
    ring, place = np.divmod(np.arange(sheet.vertices), around + 1)
    angle, x = 2.0 * np.pi * place / around, ring / (along - 1) - 0.5
    points = np.stack([x, 2.0 + 0.25 * np.cos(angle), 0.25 * np.sin(angle)], axis=1)
    first = ring * around + place % around  # the last column of the sheet becomes the first one
    return points[place < around], first[sheet.triangles]


def dome(side: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3) in m and triangles of a cap of a sphere above a square."""
    sheet = cloth(side, side, "xz", lift=0.0)
    x, z = sheet.points[:, 0], sheet.points[:, 2]
    return np.stack([x, 1.4 + np.sqrt(0.64 - x**2 - z**2), z], axis=1), sheet.triangles


def arch(length: int = 36, side: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3) in m and tetrahedra of half a ring that stands on its two ends."""
    straight = bar(length, side, side, lift=0.0)
    angle = np.pi * (straight.points[:, 0] + 0.5)
    radius = 0.4 + straight.points[:, 1]
    x, y = -radius * np.cos(angle), 1.0 + radius * np.sin(angle)
    return np.stack([x, y, straight.points[:, 2]], axis=1), straight.tetrahedra


def taper(length: int = 36, side: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3) in m and tetrahedra of a bar along x whose sides become half as long."""
    straight = bar(length, side, side, lift=0.0)
    x, y, z = straight.points.T
    scale = 0.9 - 0.6 * x
    return np.stack([x, 2.0 + scale * y, scale * z], axis=1), straight.tetrahedra


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    for shape in (tube, dome):
        points, corners = shape()
        lines = [f"v {' '.join(f'{x:.12g}' for x in row)}" for row in points]
        lines += [f"f {' '.join(map(str, row))}" for row in corners + 1]
        (folder / f"{shape.__name__}.obj").write_text("\n".join(lines) + "\n")
    for shape in (arch, taper):
        points, corners = shape()
        mesh = meshio.Mesh(points, [("tetra", corners)])
        mesh.write(folder / f"{shape.__name__}.vtu", binary=True)
