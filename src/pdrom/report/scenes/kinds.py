"""Kinds of files that are made of one scene; read before anything is drawn, so nothing is here."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from pdrom.core import paths
from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.paths import Place
from pdrom.core.provenance import made_by
from pdrom.report.viewer.runs import ViewedScene


@dataclass(frozen=True)
class Kind:
    """Files of one scene. A function of ``module`` that has the kind's name writes them.

    title : what they show
    files : their names in the folder of the scene
    reads : kinds of results of the pipeline, one for each group and method where they say so
    by_default : made where no kind is asked for
    tables : tables that only results of the pipeline give
    """

    title: str
    module: str
    files: tuple[str, ...]
    reads: tuple[Place, ...]
    by_default: bool = True
    tables: tuple[str, ...] = ()


RUNS = (paths.MESH, paths.TRAIN, paths.SENSITIVITY, paths.RERUNS)
MEASURED = (
    *RUNS, paths.RECONSTRUCTION, paths.RERUNS_TRAIN, paths.SUBSPACES, paths.SUBSPACES_TRAIN,
    paths.TIMINGS,
)  # fmt: skip
HELD_OUT = (paths.RERUNS_HELDOUT, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_CONVERGED)
EFFECTS = (paths.CONTRIBUTIONS, paths.EFFECTS, paths.LEFT_OUT, paths.ITERATIONS)

KINDS: dict[str, Kind] = {
    "frames": Kind(
        "Four frames of the full-order run and of reduced ones", "frames",
        ("frames.pdf", "frames.png"), RUNS,
    ),
    "error_against_r": Kind(
        "Errors against the basis size", "errors",
        ("error_against_r.pdf", "error_against_r.png"), MEASURED,
    ),
    "error_against_time": Kind(
        "Errors against time", "errors",
        ("error_against_time.pdf", "error_against_time.png"), RUNS,
    ),
    "runs": Kind("Table of the reduced runs", "tables", ("runs.csv",), MEASURED),
    "advice": Kind(
        "Tables: what each effect does, and errors and times of all settings",
        "tables", ("effects_contribution.csv", "accuracy_cost.csv"),
        (*MEASURED, *HELD_OUT, *EFFECTS),
        by_default=False, tables=("effects_contribution", "accuracy_cost"),
    ),
    "animation": Kind("Film (MP4)", "film", ("animation.mp4",), RUNS, by_default=False),
    "gif": Kind("Film (GIF)", "film", ("animation.gif",), RUNS, by_default=False),
    "vtk": Kind("Files for ParaView", "vtk", ("vtk/run.pvd",), RUNS, by_default=False),
    "viewer": Kind("Page to look at the runs", "page", ("viewer.html",), RUNS, by_default=False),
}  # fmt: skip
DEFAULT = tuple(name for name, kind in KINDS.items() if kind.by_default)


def require_kinds(names: Sequence[str], source: str) -> tuple[str, ...]:
    """``names``, or those made by default without any.

    Raises
    ------
    ConfigurationError
        There is no such kind; ``source`` opens the message.
    """
    for name in names:
        if name not in KINDS:
            raise ConfigurationError(
                f"{source}: nothing is called '{name}'{choices(name, list(KINDS))}"
            )
    return tuple(names) or DEFAULT


def draw(scene: ViewedScene, name: str, folder: Path) -> list[Path]:
    """Write the files of a kind, ``name``, into the ``folder`` of a ``scene``.

    Raises
    ------
    ConfigurationError
        The kind needs tables that own runs do not have.
    StorageError
        A file cannot be read or written.
    """
    kind = KINDS[name]
    if any(table not in scene.tables for table in kind.tables):
        raise ConfigurationError(
            f"{name}: made of the pipeline's results alone (./reproduce scene NAME {name}), "
            "not of single runs"
        )
    files = [folder / file for file in kind.files]
    with made_by("pdrom.draw", {"scene": scene.name, "kind": name}):
        getattr(import_module(f"{__package__}.{kind.module}"), name)(scene, *files)
    return files
