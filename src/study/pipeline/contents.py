"""Contents of a results folder: which files of each kind a configuration holds.

What the labels of a kind can be follows from the scenes, their groups and the methods of the study.
A kind that only some of them have is listed here.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.artifact.paths import Place
from study.figures.kit.declaration import declarations
from study.paper.build import FILES
from study.pipeline.scenes import not_taken
from study.pipeline.study import Study
from study.tables import declared

Labels = dict[str, str]


def labels_of(study: Study, place: Place) -> list[Labels]:
    """Labels of every file of a kind, ``place``, in the order of ``study``, without repetition."""
    found = _found(study, place)
    return list({tuple(labels.items()): labels for labels in found}.values())


def _found(study: Study, place: Place) -> Iterator[Labels]:
    names = place.labels
    scenes = SCENES[place](study) if place in SCENES else study.scenes
    if place in NAMES:
        yield from ({"name": name} for name in NAMES[place]())
    elif names == ["mesh"]:
        yield from ({"mesh": mesh} for mesh in study.meshes)
    elif "group" in names:
        for scene, group in study.experiments:
            if place in GROUPS and not GROUPS[place](study, scene, group):
                continue
            for name, method in study.methods.items():
                known = {"scene": scene, "group": group, "method": name, "basis": method.basis_id}
                yield {label: known[label] for label in names}
    elif "factor" in names and isinstance(scenes, Mapping):
        for scene in (name for name in scenes if name in study.scenes):
            yield from ({"scene": scene, "factor": f"{factor:g}"} for factor in scenes[scene])
    elif "scene" in names:
        for scene in scenes:
            for run in ("train", *MOTIONS):
                known = {"scene": scene, "run": run}
                yield {label: known[label] for label in names}
    else:
        yield {}


def _held(study: Study, listed: Iterable[str]) -> list[str]:
    """Scenes of the study that are ``listed``, in its order."""
    return [scene for scene in study.scenes if scene in {*listed}]


def _with_subspaces(study: Study) -> list[str]:
    """The listed scenes, or all; none where no model is asked for, or none takes an effect."""
    section = study.settings.subspace
    if not (section.bases and section.sizes):
        return []
    takes = [name for name, scene in study.scenes.items() if not not_taken(scene)]
    return _held(study, section.scenes or takes)


def _requested(study: Study) -> list[str]:
    """The listed scenes, or all, the large ones among them."""
    held, listed = [*study.scenes, *study.online], study.settings.requested_tolerances.scenes
    return [scene for scene in held if scene in (listed or held)]


def _live(study: Study) -> list[str]:
    """The listed scenes that the study has models of."""
    held = {*_with_subspaces(study), *study.online}
    return [scene for scene in study.settings.live.scenes if scene in held]


# Names of the files that every study has.
NAMES: dict[Place, Callable[[], Iterable[str]]] = {
    paths.TABLE: declared,
    paths.FIGURE: declarations,
    paths.FIGURE_PICTURE: declarations,
    paths.PAPER_INPUT: lambda: FILES,
}
# Which of the scenes have files of a kind, with the factors of their mesh size where it has these.
SCENES: dict[Place, Callable[[Study], Iterable[str]]] = {
    paths.SUBSPACES: _with_subspaces,
    paths.SUBSPACES_TRAIN: _with_subspaces,
    paths.SUBSPACES_HELDOUT: _with_subspaces,
    paths.SUBSPACES_SECONDS: _with_subspaces,
    paths.SCALING: lambda study: study.settings.scaling.scenes,
    paths.BREAK_EVEN_SIZED: lambda study: study.settings.scaling.scenes,
    paths.ALTERNATIVES: lambda study: study.settings.alternatives.scenes,
    paths.ALTERNATIVE_TIMES: lambda study: study.settings.alternatives.scenes,
    paths.ONLINE: lambda study: study.online,
    paths.ONLINE_MODELS: lambda study: study.online,
    paths.LIVE_MODEL: _live,
    paths.STABILITY: lambda study: _held(study, study.settings.stability.scenes),
    paths.REQUESTED_TOLERANCES: _requested,
}
# Whether a reduced group of a scene has files of a kind.
GROUPS: dict[Place, Callable[[Study, str, str], bool]] = {
    paths.REPETITIONS: lambda study, scene, group: any(
        scene in cell.scenes for cell in study.settings.repetitions.cells
    ),
    paths.NOISE: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.NOISE_RUNS: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.LADDER: lambda study, scene, group: scene in study.settings.ladder.scenes,
}
