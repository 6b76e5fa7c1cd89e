"""Declaration of commands of ``pdrom``, exit codes, and checks of output paths."""

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
    """Return argparse keywords of an argument that is text; ``what`` is its help."""
    return {"metavar": metavar, "help": what, **more}


def number(default: float | None, what: str) -> dict[str, Any]:
    """Return argparse keywords of a numeric option; the help shows its ``default`` if not None."""
    shown = what if default is None else f"{what} (default: {default:g})"
    return {"type": int if isinstance(default, int) else float, "default": default, "help": shown}


def flag(what: str) -> dict[str, Any]:
    """Return argparse keywords of an option without a value."""
    return {"action": "store_true", "help": what}


# Arguments that several commands have.
SCENE = text("SCENE.yaml", "scene file")
UNCHECKED = flag("accept runs without a checksum, which older versions of pdrom wrote")


def require_output(path: str | Path, reads: Sequence[str], scene: "Scene | None" = None) -> None:
    """Refuse an output ``path`` that is one of the files ``reads``, or that pdrom may not write.

    The first of ``reads`` is the file of the ``scene``, whose mesh file is protected as well.
    """
    from pdrom.core.store import require_own
    from pdrom.model.mesh.config import MeshFile

    if scene and isinstance(scene.config.mesh, MeshFile):
        reads = [*reads, str(scene.config.mesh.file(Path(reads[0]).parent))]
    if any(Path(path).resolve() == Path(read).resolve() for read in reads):
        raise StorageError(f"{path}: the output would replace a file that is read; rename it")
    require_own(path)
