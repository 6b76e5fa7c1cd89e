"""``pdrom new SCENE``: write a commented scene file as a starting point."""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import Command, Status

if TYPE_CHECKING:
    from pdrom.model.mesh.types import Mesh

TEMPLATE = """\
# A scene. All keys: config/README.md. Units: metres, seconds, kilograms, newtons.
name: {name} # this and the title may be left out: they follow from the file's name
title: {title}

# What moves. Also {{kind: bar, nx: 40, ny: 5, nz: 5}}, or a file with triangles or tetrahedra:
# {{kind: file, path: sheet.obj, scale: 1.0}}
{about}mesh: {mesh}

frames: 100 # to simulate
time_step: 0.016 # s
iterations: 10 # local and global steps of a frame
{mass}

# Only what is listed is loaded and computed.
effects:
  - {{effect: gravity{pull}}} # along -{up}
  - {floor}
  - {{effect: pins, select: {side}}} # held: a side (left, right, top ...) or a list of vertices
  # a handle: held vertices, moved by `offset` (m) over 50 frames; any `select` may be a place
  # - {{effect: translate, select: right, offset: [0.3, 0.0, 0.0], over: 50}}
  # - {{effect: pins, select: {{kind: sphere, centre: [0.5, 2.0, 0.0], radius: 0.1}}}}
  # an obstacle; also plane, box
  # - {{effect: sphere, centre: [0.0, 1.0, 0.0], radius: 0.4, friction: 0.3}}
{groups}
# Groups whose projections are reduced, and the number of snapshots (even frames of the run) that
# train a basis.
reduce:
  {group}: {{train: 40}}

# Held-out motions, on which a reduction is tested: pins move by so many m, vertices start at m/s.
held_out: {{carry: 0.5, kick: 2.0}}
"""
GENERATED = "{kind: cloth, rows: 20, columns: 20, plane: xz}"
SURFACE = """\
  # constraint groups of surfaces: edges keep their length, triangles their shape or area, bending
  - {effect: spring, weight: 1.0e+5}
  # - {effect: strain, weight: 1.0e+5}
  # - {effect: area, weight: 1.0e+5}
  # - {effect: bending, weight: 0.1}
"""
VOLUME = """\
  # constraint groups of volumes: tetrahedra keep their shape, or their volume
  - {effect: tetrahedron_strain, weight: 1.0e+6}
  # - {effect: volume, weight: 1.0e+6}
"""
KILOGRAMS = 10.0  # mass of a vertex of a new scene; the constraint weights above suit it
ENOUGH = 3  # smallest number of fixed vertices with which a body cannot turn about a line


def perform(arguments: argparse.Namespace) -> Status:
    """Write the scene that ``arguments`` name, with comments; an existing file is left alone."""
    from pdrom.core.errors import ConfigurationError, reason

    path = Path(arguments.scene)
    path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
    merge = arguments.merge
    file, mesh = _read(arguments.mesh, path, merge) if arguments.mesh else (None, None)
    text = template(path.stem, file, mesh, arguments.up, merge)
    try:
        with path.open("x", encoding="utf-8") as made:
            made.write(text)
    except FileExistsError:
        raise ConfigurationError(f"{path}: there is such a file already; name another") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be written ({reason(error)})") from error
    sys.stdout.write(f"{path}: written; edit it, then: pdrom run {path}\n")
    return Status.DONE


def template(
    stem: str,
    file: str | None = None,
    mesh: "Mesh | None" = None,
    up: str = "y",
    merge: float = 0.0,
) -> str:
    """Text of a scene file; the scene has a generated sheet, or the ``mesh`` read from ``file``.

    The scene is named after ``stem``, the name of its file; ``up`` is the upward axis of the mesh,
    in which vertices that are closer than ``merge`` times the extent are merged.
    """
    from pdrom.core.yamlfile import named
    from pdrom.model.mesh.types import vertex_measures

    names = {key: json.dumps(value, ensure_ascii=False) for key, value in named({}, stem).items()}
    if mesh is None:
        groups = SURFACE + VOLUME.replace("  - {", "  # - {")
        floor, side, about, made = "{effect: floor} # at y = 0", "left", "", GENERATED
        mass, up = "vertex_mass: 10.0 # kg of each vertex", "y"
    else:
        groups = VOLUME if len(mesh.tetrahedra) else SURFACE
        axis = "xyz".index(up)
        floor, side, about = _floor(mesh, axis), _side(mesh, axis), _about(mesh)
        density = float(f"{KILOGRAMS * mesh.vertices / vertex_measures(mesh).sum():.2g}")
        unit = "kg/m^3" if len(mesh.tetrahedra) else "kg/m^2"
        mass = f"masses: [{{density: {density:.12g}}}] # {unit}: about {KILOGRAMS:g} kg a vertex"
        more = f", merge: {merge:.1e}" if merge else ""
        made = f"{{kind: file, path: {json.dumps(file, ensure_ascii=False)}{more}}}"
    group = "tetrahedron_strain" if groups == VOLUME else "spring"
    pull = (
        "" if up == "y" else f", acceleration: {[-9.81 if axis == up else 0.0 for axis in 'xyz']}"
    )
    return TEMPLATE.format(
        **names, **{"mesh": made, "about": about, "mass": mass, "pull": pull, "up": up},
        floor=floor, side=side, groups=groups, group=group,
    )  # fmt: skip


def _read(file: str, scene: Path, merge: float) -> "tuple[str, Mesh]":
    """Path of the mesh ``file`` relative to the folder of the ``scene`` file, and its mesh."""
    from pdrom.core.errors import ConfigurationError
    from pdrom.core.yamlfile import validate
    from pdrom.model.mesh.config import MeshFile

    folder = scene.resolve().parent
    try:
        inside = (Path(file).parent.resolve() / Path(file).name).relative_to(folder)
    except ValueError:
        raise ConfigurationError(
            f"--mesh {file}: required is a file below {folder}, the folder of the scene"
        ) from None
    keys = {"kind": "file", "path": inside.as_posix(), "merge": merge}
    config = validate(MeshFile, keys, f"--mesh {file}")
    return config.path, config.build(folder)


def _about(mesh: "Mesh") -> str:
    """YAML comments with the size and position of the mesh, and the vertex counts of its sides."""
    from pdrom.model.mesh.checks import seams

    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    places = (
        f"{axis} from {a:.3g} to {b:.3g}" for axis, a, b in zip("xyz", low, high, strict=True)
    )
    cells = f"{len(mesh.triangles)} triangles"
    if len(mesh.tetrahedra):
        cells = f"{len(mesh.tetrahedra)} tetrahedra"
    sides = (f"{side} {count}" for side, count in _sides(mesh).items())
    return (
        f"# Of this file: {mesh.vertices} vertices, {cells}, {seams(mesh)}; "
        f"{', '.join(places)} (m).\n"
        f"# Its sides, with the number of their vertices: {', '.join(sides)}.\n"
    )


def _sides(mesh: "Mesh") -> dict[str, int]:
    """Map the name of each side that the mesh has (left, top, ...) to its number of vertices."""
    from pdrom.core.errors import SceneError
    from pdrom.model.mesh.selection import SIDES, select_vertices

    found = {}
    for side in SIDES:
        try:
            found[side] = len(select_vertices(mesh, side))
        except SceneError:  # the mesh is flat along this side's axis: it has no such side
            continue
    return found


def _side(mesh: "Mesh", axis: int) -> str:
    """YAML of vertices to pin: those of a side if at least `ENOUGH`, else `ENOUGH` at the top."""
    for side, count in _sides(mesh).items():
        if count >= ENOUGH:
            return side
    top = mesh.points[mesh.points[:, axis].argmax()].tolist()
    return f"{{kind: nearest, point: {top}, count: {ENOUGH}}}"


def _floor(mesh: "Mesh", axis: int) -> str:
    """YAML of a floor below the mesh by about half its longest side, where ``axis`` points up."""
    lowest = float(mesh.points[:, axis].min())
    step = 10.0 ** math.floor(math.log10(mesh.extent))
    height = math.floor((lowest - mesh.extent / 2.0) / step) * step
    below = f"below the mesh, which begins at {'xyz'[axis]} = {lowest:.3g}"
    if axis == 1:
        return f"{{effect: floor, height: {height:.12g}}} # {below}"
    point, normal = ([x if i == axis else 0.0 for i in range(3)] for x in (height, 1.0))
    return f"{{effect: plane, point: {point}, normal: {normal}}} # {below}"


COMMAND = Command(
    "Write the file of a new scene, with comments",
    "pdrom new sheet.yaml --mesh sheet.obj",
    {
        "scene": {"metavar": "SCENE", "help": "file to write; .yaml is added to a name"},
        "--mesh": {"metavar": "FILE", "help": "mesh file (.obj, .vtu, .msh ...)"},
        "--merge": {
            "type": float,
            "default": 0.0,
            "metavar": "FRACTION",
            "help": "merge vertices of the mesh that are closer than this fraction of its extent",
        },
        "--up": {"choices": "xyz", "default": "y", "help": "axis of the mesh that points up (y)"},
    },
    perform,
)
