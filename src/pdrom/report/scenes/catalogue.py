"""Which artifacts there are of a single scene; read at every plan, so nothing is drawn here."""

from collections.abc import Mapping
from dataclasses import dataclass

from pdrom.core.paths import (
    ANIMATION,
    ANIMATION_GIF,
    CONTRIBUTIONS,
    EFFECTS,
    ITERATIONS,
    LEFT_OUT,
    MESH,
    RECONSTRUCTION,
    RERUNS,
    RERUNS_TRAIN,
    SCENE_PICTURE,
    SCENE_PICTURE_PNG,
    SCENE_RUNS,
    SCENE_TABLE,
    SCENE_VIEWER,
    SENSITIVITY,
    SUBSPACES,
    SUBSPACES_TRAIN,
    TIMINGS,
    TRAIN,
    VTK,
    Place,
)


@dataclass(frozen=True)
class SceneArtifact:
    """An artifact of one scene. A module of this package with its name makes it.

    title : what it shows
    outputs : files written, which the scene's name labels
    reads : kinds of files of the scene, one for each of its groups and methods where they say so
    by_default : made by ``./reproduce scene NAME``; the others are asked for by name
    sources : files of the project that are parts of it and no Python
    """

    title: str
    outputs: Mapping[str, Place]
    reads: tuple[Place, ...]
    by_default: bool = True
    sources: tuple[str, ...] = ()

    def files(self, results: str, scene: str) -> list[str]:
        """Paths of what is written for a scene below the folder ``results``."""
        return [place.at(results, scene=scene) for place in self.outputs.values()]


PAGE = tuple(f"src/pdrom/report/viewer/viewer.{kind}" for kind in ("html", "css", "js"))


def _picture(name: str) -> dict[str, Place]:
    return {
        "pdf": SCENE_PICTURE.where(name=name),
        "png": SCENE_PICTURE_PNG.where(name=name),
    }


# what the rows of reduced runs are made of
MEASURED = (SENSITIVITY, RERUNS, RERUNS_TRAIN, SUBSPACES, SUBSPACES_TRAIN, TIMINGS)

ARTIFACTS: dict[str, SceneArtifact] = {
    "frames": SceneArtifact(
        "Frames of the full-order run and of reduced ones",
        _picture("frames"),
        (MESH, TRAIN, SENSITIVITY, RERUNS),
    ),
    "error_against_r": SceneArtifact(
        "Errors against the basis size",
        _picture("error_against_r"),
        (SENSITIVITY, RECONSTRUCTION, RERUNS, RERUNS_TRAIN),
    ),
    "error_against_time": SceneArtifact(
        "Errors against time", _picture("error_against_time"), (SENSITIVITY, RERUNS)
    ),
    "runs": SceneArtifact(
        "Table of the reduced runs",
        {"table": SCENE_RUNS},
        (RECONSTRUCTION, *MEASURED),
    ),
    "advice": SceneArtifact(
        "Tables for pdrom advise: what each effect does, and errors and times of all settings",
        {
            "effects": SCENE_TABLE.where(name="effects_contribution"),
            "costs": SCENE_TABLE.where(name="accuracy_cost"),
        },
        (CONTRIBUTIONS, EFFECTS, LEFT_OUT, ITERATIONS, *MEASURED),
        by_default=False,
    ),
    "animation": SceneArtifact(
        "Animation", {"film": ANIMATION}, (MESH, TRAIN, RERUNS), by_default=False
    ),
    "gif": SceneArtifact(
        "Animation (GIF)", {"film": ANIMATION_GIF}, (MESH, TRAIN, RERUNS), by_default=False
    ),
    "vtk": SceneArtifact(
        "Files for ParaView", {"collection": VTK}, (MESH, TRAIN, RERUNS), by_default=False
    ),
    "viewer": SceneArtifact(
        "Viewer",
        {"page": SCENE_VIEWER},
        (MESH, TRAIN, SENSITIVITY, RERUNS),
        by_default=False,
        sources=PAGE,
    ),
}


def module(name: str) -> str:
    """The module that makes an artifact."""
    return f"{__package__}.{name}"


def default_files(results: str, scene: str) -> list[str]:
    """Files that ``./reproduce scene NAME`` makes."""
    made = [a for a in ARTIFACTS.values() if a.by_default]
    return [file for artifact in made for file in artifact.files(results, scene)]
