"""``pdrom new SCENE``: write a commented scene file as a starting point."""

import argparse
import json
import math
import re
import sys
from contextlib import suppress
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from pdrom.command.base import Command, Status, number, text
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, SceneError, reason
from pdrom.core.yamlfile import named, validate

if TYPE_CHECKING:
    import numpy as np

    from pdrom.model.mesh.types import Mesh

# Density in a new scene: cotton for a surface, kg/m^2; water for a volume, kg/m^3.
DENSITY = {2: 0.2, 3: 1000.0}
# Relative stretch of a hanging body at its top; weight of bending over strain weight x extent^2.
STRETCH, BENDING = 0.02, 1e-6
ENOUGH = 3  # smallest number of fixed vertices with which a body cannot turn about a line


def perform(arguments: argparse.Namespace) -> Status:
    """Write the commented scene file that ``arguments`` name; never replace an existing file."""
    from pdrom.api.files import require_no_mesh

    if arguments.scene is None and arguments.mesh is None:
        raise ConfigurationError("no file name: give the scene file to write, or a mesh (--mesh)")
    path = Path(arguments.scene or Path(arguments.mesh).with_suffix(".yaml"))
    require_no_mesh(path)
    path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
    merge = arguments.merge
    if merge and not arguments.mesh:
        raise ConfigurationError("--merge: only for mesh files; add --mesh FILE")
    file, mesh = _read(arguments.mesh, path, merge) if arguments.mesh else (None, None)
    text = template(path.stem, file, mesh, arguments.up, merge)
    try:
        with path.open("x", encoding="utf-8") as made:
            made.write(text)
    except FileExistsError:
        raise ConfigurationError(f"{path}: the file exists already; choose another name") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be written ({reason(error)})") from error
    sys.stdout.write(f"{path}: written; edit it, then run: pdrom run {path}\n")
    return Status.DONE


def template(
    stem: str, file: str | None = None, mesh: "Mesh | None" = None, up: str = "y", merge: float = 0
) -> str:
    """Return the text of a scene file with a generated sheet, or the ``mesh`` read from ``file``.

    The scene is named after ``stem``, the name of its file; ``up`` is the upward axis of the mesh.
    Vertices that are closer than ``merge`` times the extent are merged. Numbers and sides in the
    examples fit the mesh.
    """
    from pdrom.model.mesh.generators import Plane, cloth
    from pdrom.model.mesh.types import vertex_measures

    if mesh is None:
        plane: Plane = "xz" if up == "y" else "xy"
        mesh, made = cloth(20, 20, plane), f"{{kind: cloth, rows: 20, columns: 20, plane: {plane}}}"
    else:
        more = f", merge: {merge:.1e}" if merge else ""
        made = f"{{kind: file, path: {json.dumps(file, ensure_ascii=False)}{more}}}"
    names = {key: json.dumps(value, ensure_ascii=False) for key, value in named({}, stem).items()}
    axis, side, dimension = "xyz".index(up), mesh.extent, 3 if len(mesh.tetrahedra) else 2
    text = config_file("new_scene.txt").read_text("utf-8").partition("\n")[2]
    text = re.sub(rf"(?m)^(?!{dimension})[23]\|.*\n|^{dimension}\|", "", text)
    density, total = DENSITY[dimension], float(vertex_measures(mesh).sum())
    weight = 9.81 * density * side / STRETCH
    held, moved, corner = _held(mesh, axis)
    below = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    below[axis] = mesh.points[:, axis].min() - 0.25 * side
    centre = [round(x, 2 - math.floor(math.log10(side))) + 0.0 for x in below.tolist()]
    pull = "" if up == "y" else f", acceleration: {_along(axis, -9.81)}"
    return Template(text).substitute(
        **names, mesh=made, about=_about(mesh), density=density, total=_plain(density * total),
        up=up, pull=pull, floor=_floor(mesh, axis), held=held, moved=moved, corner=corner,
        offset=_along(axis, _short(0.3 * side)), below=centre, weight=_short(weight),
        bending=_short(BENDING * weight * side**2), tenth=_short(0.1 * side),
        fifth=_short(0.2 * side), half=_short(0.5 * side), twice=_short(2.0 * side),
    )  # fmt: skip


def _short(number: float) -> float:
    return float(f"{number:.2g}")


def _plain(number: float) -> str:
    return f"{float(f'{number:.3g}'):.15g}"


def _along(axis: int, number: float) -> list[float]:
    return [number if i == axis else 0.0 for i in range(3)]


def _read(file: str, scene: Path, merge: float) -> "tuple[str, Mesh]":
    """Return the path of the mesh ``file`` relative to the folder of ``scene``, and its mesh."""
    from pdrom.model.mesh.config import MeshFile

    folder = scene.resolve().parent
    inside = Path(file).parent.resolve() / Path(file).name
    if not inside.is_relative_to(folder):
        required = f"the mesh must be in or below {folder}, the scene's folder"
        raise ConfigurationError(f"--mesh {file}: {required}")
    keys = {"kind": "file", "path": inside.relative_to(folder).as_posix(), "merge": merge}
    config = validate(MeshFile, keys, f"--mesh {file}")
    return config.path, config.build(folder)


def _about(mesh: "Mesh") -> str:
    """Return YAML comments with size and position of the mesh and vertex counts of its sides."""
    from pdrom.model.mesh.checks import seams

    ends = zip("xyz", mesh.points.min(axis=0), mesh.points.max(axis=0), strict=True)
    places = (f"{axis} from {_plain(low)} to {_plain(high)}" for axis, low, high in ends)
    kind = "tetrahedra" if len(mesh.tetrahedra) else "triangles"
    cells = f"{len(getattr(mesh, kind))} {kind}"
    sides = (f"{side} {len(vertices)}" for side, vertices in _sides(mesh).items())
    return (
        f"# Mesh of {mesh.vertices} vertices, {cells}, {seams(mesh)}; {', '.join(places)} (m).\n"
        f"# Its sides, and their numbers of vertices: {', '.join(sides)}.\n"
    )


def _sides(mesh: "Mesh") -> "dict[str, np.ndarray]":
    """Map the name of each side that the mesh has (x_min ...) to its vertices."""
    from pdrom.model.mesh.selection import SIDES, select_vertices

    found = {}
    for side in SIDES:
        with suppress(SceneError):  # the mesh is flat along this side's axis: it has no such side
            found[side] = select_vertices(mesh, side)
    return found


def _held(mesh: "Mesh", up: int) -> tuple[str, str, list[float]]:
    """Return YAML of vertices to pin and of others to move, and the position of a pinned vertex.

    Pin a side that has at least `ENOUGH` vertices, else the `ENOUGH` vertices at the top. The side
    is normal to the longest axis that has one; if this axis points up, the top is preferred.
    """
    sides, lengths = _sides(mesh), mesh.points.max(axis=0) - mesh.points.min(axis=0)
    for axis in sorted(range(3), key=lambda i: (-lengths[i], i == up)):
        ends = [f"{'xyz'[axis]}_{end}" for end in ("min", "max")]
        for held, moved in (ends, ends[::-1])[:: -1 if axis == up else 1]:
            if len(sides.get(held, ())) >= ENOUGH:
                return held, moved, mesh.points[sides[held][0]].tolist()
    order = mesh.points[:, up].argsort(kind="stable")
    low, top = mesh.points[order[[0, -1]]].tolist()
    lowest = f"{{kind: nearest, point: {low}}}"
    return f"{{kind: nearest, point: {top}, count: {ENOUGH}}}", lowest, top


def _floor(mesh: "Mesh", axis: int) -> str:
    """Return YAML of a floor about half the longest side below the mesh; ``axis`` points up."""
    lowest = float(mesh.points[:, axis].min())
    step = 10.0 ** math.floor(math.log10(mesh.extent))
    height = round(math.floor((lowest - mesh.extent / 2.0) / step) * step, 12)
    below = f"below the mesh, which begins at {'xyz'[axis]} = {_plain(lowest)}"
    if axis == 1:
        return f"{{effect: floor, height: {height}}} # {below}"
    point, normal = (_along(axis, x) for x in (height, 1.0))
    return f"{{effect: plane, point: {point}, normal: {normal}}} # {below}"


COMMAND = Command(
    "Write a scene file with comments, which you can edit",
    "pdrom new sheet.yaml --mesh sheet.obj",
    {
        "scene": text("SCENE", "scene file to write (default: the name of the mesh)", nargs="?"),
        "--mesh": text("FILE", "mesh file (.obj, .vtu, .msh ...; default: a generated sheet)"),
        "--merge": number(0.0, "merge vertices closer than this fraction of the mesh's extent"),
        "--up": {"choices": "xyz", "default": "y", "help": "upward axis (default: y)"},
    },
    perform,
)
