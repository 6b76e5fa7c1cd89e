"""Declaration of a command of ``pdrom``, exit codes, and paths of a command's files."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

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


# Keywords of `add_argument` for arguments that several commands have.
SCENE = {"metavar": "SCENE.yaml", "help": "file of the scene"}
UNCHECKED = {
    "action": "store_true",
    "help": "read a run without a checksum inside (by an older pdrom) if it is sound",
}


def files_of(file: str, scene: "Scene") -> list[str]:
    """Paths of the files of a ``scene``: the scene's ``file`` and, if it has one, its mesh file."""
    from pdrom.model.mesh.config import MeshFile

    mesh = scene.config.mesh
    return [file, *([str(mesh.file(Path(file).parent))] if isinstance(mesh, MeshFile) else [])]


def require_output(path: str | Path, reads: Sequence[str]) -> None:
    """Check that the output ``path`` is none of the files ``reads``, and with `require_own`."""
    from pdrom.core.errors import StorageError
    from pdrom.core.store import require_own

    if any(Path(path).resolve() == Path(read).resolve() for read in reads):
        raise StorageError(f"{path}: would be overwritten, and is read by this command")
    require_own(path)
