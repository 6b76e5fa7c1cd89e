"""Declaration of a command of ``pdrom``, exit codes, and paths of a command's files."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdrom.core.errors import StorageError

if TYPE_CHECKING:
    from pdrom.model.scene import Scene


class Status(IntEnum):
    """Exit codes; argparse itself uses 2 for invalid arguments."""

    DONE = 0
    FAULTY = 1
    BLEW_UP = 3


@dataclass(frozen=True)
class Command:
    """A command of ``pdrom``; ``arguments`` maps names to keywords of argparse's `add_argument`."""

    title: str
    example: str
    arguments: Mapping[str, dict[str, Any]]
    perform: Callable[[argparse.Namespace], Status]


def text(metavar: str, what: str, **more: Any) -> dict[str, Any]:
    """Keywords of an argument that is a text or several; ``what`` is its help."""
    return {"metavar": metavar, "help": what, **more}


def number(default: float | None, what: str) -> dict[str, Any]:
    """Keywords of an option that is a number, with its default value; None has no value."""
    shown = what if default is None else f"{what} ({default:g})"
    return {"type": int if isinstance(default, int) else float, "default": default, "help": shown}


def flag(what: str) -> dict[str, Any]:
    """Keywords of an option without a value."""
    return {"action": "store_true", "help": what}


# Arguments that several commands have.
SCENE = text("SCENE.yaml", "file of the scene")
UNCHECKED = flag("read a run without a checksum inside (by an older pdrom) if it is sound")


def require_output(path: str | Path, reads: Sequence[str], scene: "Scene | None" = None) -> None:
    """Refuse an output ``path`` that is one of the files ``reads``, or that pdrom may not write.

    The first of ``reads`` is the file of the ``scene``; its mesh file is read, too.
    """
    from pdrom.core.store import require_own
    from pdrom.model.mesh.config import MeshFile

    if scene and isinstance(scene.config.mesh, MeshFile):
        reads = [*reads, str(scene.config.mesh.file(Path(reads[0]).parent))]
    if any(Path(path).resolve() == Path(read).resolve() for read in reads):
        raise StorageError(f"{path}: would be overwritten, and is read by this command")
    require_own(path)
