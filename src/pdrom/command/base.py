"""Declaration of a command."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pdrom.model.scene import Scene


class Status(IntEnum):
    """Exit codes; 2 is argparse's, for what it does not understand."""

    DONE = 0
    FAULTY = 1
    BLEW_UP = 3
    NOTHING_FITS = 4


@dataclass(frozen=True)
class Command:
    """A command of ``pdrom``.

    title : what it does, one line
    example : a call
    arguments : keywords of `argparse.ArgumentParser.add_argument` for each of its arguments
    perform : does it and returns the exit code
    one_of : arguments of which one call has one at most
    """

    title: str
    example: str
    arguments: Mapping[str, dict[str, Any]]
    perform: Callable[[argparse.Namespace], Status]
    one_of: Sequence[str] = ()


# Arguments of more than one command.
SCENE = {"metavar": "SCENE.yaml", "help": "file of the scene"}
UNCHECKED = {
    "action": "store_true",
    "help": "read a run without a checksum inside (by an older pdrom) if it is sound",
}


def files_of(file: str, scene: "Scene") -> list[str]:
    """Files that a ``scene`` consists of: its own ``file`` and that of its mesh."""
    from pdrom.model.mesh.config import MeshFile

    mesh = scene.config.mesh
    return [file, *([str(mesh.file(Path(file).parent))] if isinstance(mesh, MeshFile) else [])]


def require_output(path: str | Path, reads: Sequence[str]) -> None:
    """Check a ``path`` to write before anything long is computed for it.

    Raises
    ------
    StorageError
        The file cannot be written, would replace one that pdrom has not made, or is one of those
        that the command ``reads``.
    """
    from pdrom.core.errors import StorageError
    from pdrom.core.store import require_own, require_place

    require_place(path)
    if any(Path(path).resolve() == Path(read).resolve() for read in reads):
        raise StorageError(f"{path}: would be overwritten, and is read by this command")
    require_own(path)
