"""``pdrom new SCENE``: the file of a scene to begin with."""

import argparse
import re
import sys
from pathlib import Path

from pdrom.command.base import Command, Status

TEMPLATE = """\
# A scene. All keys: config/README.md. Units: metres, seconds, kilograms, newtons.
name: {name}
title: {title}

# What moves. Also {{kind: bar, nx: 40, ny: 5, nz: 5}}, {{kind: disc, edge: 0.05, hole: 0.3}},
# {{kind: solid, shape: torus, edge: 0.08}} (or ball, starfish; kind shell: their surface), or a
# file with triangles or tetrahedra: {{kind: file, path: sheet.obj, scale: 1.0}}
mesh: {mesh}

frames: 100 # to simulate
time_step: 0.016 # s
iterations: 10 # local and global steps of a frame
vertex_mass: 10.0 # kg of each vertex

# Only what is listed is loaded and computed.
effects:
  - {{effect: gravity}} # along -y
  - {{effect: floor}} # at y = 0
  - {{effect: pins, select: left}} # held: a side (left, right, top ...) or a list of vertices
  # a handle: held vertices, moved by `offset` (m) over 50 frames; any `select` may be a place
  # - {{effect: translate, select: right, offset: [0.3, 0.0, 0.0], over: 50}}
  # - {{effect: pins, select: {{kind: sphere, centre: [0.5, 2.0, 0.0], radius: 0.1}}}}
  # an obstacle; also plane, box
  # - {{effect: sphere, centre: [0.0, 1.0, 0.0], radius: 0.4, friction: 0.3}}
  # constraint groups of surfaces: edges keep their length, triangles their shape or area, bending
  - {{effect: spring, weight: 1.0e+5}}
  # - {{effect: strain, weight: 1.0e+5}}
  # - {{effect: area, weight: 1.0e+5}}
  # - {{effect: bending, weight: 0.1}}
  # and of volumes: tetrahedra keep their shape, or their volume
  # - {{effect: tetrahedron_strain, weight: 1.0e+6}}
  # - {{effect: volume, weight: 1.0e+6}}

# Groups whose projections are reduced, and the number of snapshots (even frames of the run) that
# train a basis.
reduce:
  spring: {{train: 40}}

# How the held-out motion, on which a reduction is tested, differs: an initial velocity in m/s.
held_out: {{kick: 0.5}}
"""
GENERATED = "{kind: cloth, rows: 20, columns: 20, plane: xz}"


def declare(parser: argparse.ArgumentParser) -> None:
    """The file to write, and the mesh in it."""
    parser.add_argument("scene", metavar="SCENE", help="file to write; .yaml is added to a name")
    parser.add_argument("--mesh", metavar="FILE", help="mesh file (.obj, .vtu, .msh ...)")


def perform(arguments: argparse.Namespace) -> Status:
    """Write a scene with comments; a file that is there is left alone."""
    from pdrom.core.errors import ConfigurationError
    from pdrom.core.store.oserrors import reason

    path = Path(arguments.scene)
    path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template(path.stem, arguments.mesh))
    except FileExistsError:
        raise ConfigurationError(f"{path}: there is such a file already; name another") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be written ({reason(error)})") from error
    sys.stdout.write(f"{path}: written; edit it, then: pdrom run {path}\n")
    return Status.DONE


def template(stem: str, mesh: str | None = None) -> str:
    """Text of a scene called as ``stem`` allows, on a mesh file or a generated sheet."""
    name = re.sub(r"[^a-z0-9_]+", "_", stem.lower()).lstrip("_0123456789")[:64] or "scene"
    made = f"{{kind: file, path: '{mesh}'}}" if mesh else GENERATED
    return TEMPLATE.format(name=name, title=name.replace("_", " ").capitalize(), mesh=made)


COMMAND = Command(
    "Write the file of a new scene, with comments",
    "pdrom new sheet.yaml --mesh sheet.obj",
    declare,
    perform,
)
