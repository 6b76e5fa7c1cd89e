"""Contents of a results folder: the files of each kind that a configuration produces.

The possible labels of a kind of file follow from the scenes, their constraint groups and the
methods of the study. Kinds that exist only for some of these are listed in this module.
"""

from collections.abc import Callable, Iterable, Mapping

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
    """Labels of every file of the kind ``place``, in the order of ``study``, without repetition."""
    names = place.labels
    scenes = SCENES[place](study) if place in SCENES else study.scenes
    known: Iterable[Labels] = [{}]
    if place in NAMES:
        known = ({"name": name} for name in NAMES[place]())
    elif names == ["mesh"]:
        known = ({"mesh": mesh} for mesh in study.meshes)
    elif "group" in names:
        known = (
            {"scene": scene, "group": group, "method": name, "basis": method.basis_id}
            for scene, group in study.experiments
            if place not in GROUPS or GROUPS[place](study, scene, group)
            for name, method in study.methods.items()
        )
    elif "factor" in names and isinstance(scenes, Mapping):
        held = [scene for scene in scenes if scene in study.scenes]
        known = ({"scene": name, "factor": f"{x:g}"} for name in held for x in scenes[name])
    elif "scene" in names:
        known = ({"scene": name, "run": run} for name in scenes for run in ("train", *MOTIONS))
    found = [{label: labels[label] for label in names} for labels in known]
    return list({tuple(labels.items()): labels for labels in found}.values())


def _held(study: Study, listed: Iterable[str]) -> list[str]:
    """Scenes of the study that are in ``listed``, in the order of the study."""
    return [scene for scene in study.scenes if scene in {*listed}]


def _with_subspaces(study: Study) -> list[str]:
    """Scenes with position subspaces: the configured ones, else all whose effects allow these."""
    section = study.settings.subspace
    if not (section.bases and section.sizes):
        return []
    takes = [name for name, scene in study.scenes.items() if not not_taken(scene)]
    return _held(study, section.scenes or takes)


# Values of the label "name" for kinds of files that every study has.
NAMES: dict[Place, Callable[[], Iterable[str]]] = {
    paths.TABLE: declared,
    paths.FIGURE: declarations,
    paths.FIGURE_PICTURE: declarations,
    paths.PAPER_INPUT: lambda: FILES,
}
# Files of models in position subspaces.
MODELS = (
    paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
)  # fmt: skip
# Scenes that have files of a kind; a mapping also gives the factors of the mesh size of each scene.
SCENES: dict[Place, Callable[[Study], Iterable[str]]] = {
    **dict.fromkeys(MODELS, _with_subspaces),
    paths.SCALING: lambda study: study.settings.scaling.scenes,
    paths.BREAK_EVEN_SIZED: lambda study: study.settings.scaling.scenes,
    paths.ALTERNATIVES: lambda study: study.settings.alternatives.scenes,
    paths.ALTERNATIVE_TIMES: lambda study: study.settings.alternatives.scenes,
    paths.ONLINE: lambda study: study.online,
    paths.ONLINE_MODELS: lambda study: study.online,
    # scenes for which the study has reduced models
    paths.LIVE_MODEL: lambda study: [
        scene
        for scene in study.settings.live.scenes
        if scene in {*_with_subspaces(study), *study.online}
    ],
    paths.STABILITY: lambda study: _held(study, study.settings.stability.scenes),
    # the configured scenes, else all, also large ones
    paths.REQUESTED_TOLERANCES: lambda study: [
        scene
        for scene in (*study.scenes, *study.online)
        if scene in (study.settings.requested_tolerances.scenes or (*study.scenes, *study.online))
    ],
}
# Functions of study, scene and group: True if the reduced group has files of a kind.
GROUPS: dict[Place, Callable[[Study, str, str], bool]] = {
    paths.REPETITIONS: lambda study, scene, group: any(
        scene in cell.scenes for cell in study.settings.repetitions.cells
    ),
    paths.NOISE: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.NOISE_RUNS: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.LADDER: lambda study, scene, group: scene in study.settings.ladder.scenes,
}
