"""Contents of a results folder: which files of each kind a configuration holds.

What the labels of a kind can be follows from the scenes, their groups and the methods of the study.
A kind that only some of them have is listed here.
"""

from collections.abc import Callable, Iterable, Iterator

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.artifact.paths import Place
from study.figures.kit.declaration import declarations
from study.paper.build import FILES
from study.pipeline.scenes import not_taken
from study.pipeline.study import Study
from study.tables import declared

Labels = dict[str, str]
Factors = dict[str, tuple[float, ...]]


def labels_of(study: Study, place: Place) -> list[Labels]:
    """Labels of every file of a kind, ``place``, in the order of ``study``, without repetition."""
    found = SOME[place](study) if place in SOME else _all(study, place)
    return list({tuple(labels.items()): labels for labels in found}.values())


def paths_of(study: Study, place: Place, results: str) -> list[str]:
    """Paths of every file of a kind, ``place``, of ``study`` below the folder ``results``."""
    return [place.at(results, **labels) for labels in labels_of(study, place)]


def _all(study: Study, place: Place) -> Iterator[Labels]:
    """Every combination of the labels of a kind that the study has."""
    names = place.labels
    if not names:
        yield {}
    elif names == ["mesh"]:
        yield from ({"mesh": mesh} for mesh in study.meshes)
    elif "group" in names:
        for scene, group in study.experiments:
            for name, method in study.methods.items():
                known = {"scene": scene, "group": group, "method": name, "basis": method.basis_id}
                yield {label: known[label] for label in names}
    else:
        for scene in study.scenes:
            for run in ("train", *MOTIONS):
                known = {"scene": scene, "run": run}
                yield {label: known[label] for label in names}


def _scenes(select: Callable[[Study], tuple[str, ...]]) -> Callable[[Study], Iterator[Labels]]:
    """The scenes of a list of the configuration, as far as the study holds them."""

    def held(study: Study) -> Iterator[Labels]:
        listed = select(study)
        return ({"scene": scene} for scene in study.scenes if scene in listed)

    return held


def _groups(holds: Callable[[Study, str, str], bool]) -> Callable[[Study], Iterator[Labels]]:
    """The reduced groups of scenes for which ``holds(study, scene, group)``."""

    def held(study: Study) -> Iterator[Labels]:
        found = study.experiments
        return ({"scene": s, "group": g} for s, g in found if holds(study, s, g))

    return held


def _sized(select: Callable[[Study], Factors]) -> Callable[[Study], Iterator[Labels]]:
    """The mesh sizes of scenes that the configuration lists, as far as the study holds them."""

    def held(study: Study) -> Iterator[Labels]:
        for scene, factors in select(study).items():
            if scene in study.scenes:
                yield from ({"scene": scene, "factor": f"{factor:g}"} for factor in factors)

    return held


def _with_subspaces(study: Study) -> tuple[str, ...]:
    """The listed scenes, or all; none where no model is asked for, or none takes an effect."""
    section = study.settings.subspace
    if not (section.bases and section.sizes):
        return ()
    return section.scenes or tuple(s for s, config in study.scenes.items() if not not_taken(config))


def _repeated(study: Study, scene: str, group: str) -> bool:
    return any(scene in cell.scenes for cell in study.settings.repetitions.cells)


def _noisy(study: Study, scene: str, group: str) -> bool:
    return study.settings.noise.cases.get(scene) == group


def _requested(study: Study) -> Iterator[Labels]:
    """The listed scenes, or all, the large ones among them."""
    held, listed = (*study.scenes, *study.online), study.settings.requested_tolerances.scenes
    return ({"scene": scene} for scene in held if not listed or scene in listed)


def _live(study: Study) -> Iterator[Labels]:
    """The listed scenes that the study has models of."""
    held = {*_with_subspaces(study)} & {*study.scenes} | {*study.online}
    return ({"scene": scene} for scene in study.settings.live.scenes if scene in held)


_subspaces = _scenes(_with_subspaces)
_sizes = _sized(lambda study: study.settings.scaling.scenes)
_online = [paths.ONLINE, paths.ONLINE_MODELS]
_in_subspaces = [
    paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
]  # fmt: skip


def _named(names: Callable[[], Iterable[str]]) -> Callable[[Study], Iterator[Labels]]:
    """Files that every study has, by their names."""
    return lambda study: ({"name": name} for name in names())


SOME: dict[Place, Callable[[Study], Iterator[Labels]]] = {
    paths.TABLE: _named(declared),
    **dict.fromkeys([paths.FIGURE, paths.FIGURE_PICTURE], _named(declarations)),
    paths.PAPER_INPUT: _named(lambda: FILES),
    **dict.fromkeys(_in_subspaces, _subspaces),
    **dict.fromkeys([paths.SCALING, paths.BREAK_EVEN_SIZED], _sizes),
    **dict.fromkeys(_online, lambda study: ({"scene": scene} for scene in study.online)),
    paths.REPETITIONS: _groups(_repeated),
    **dict.fromkeys([paths.NOISE, paths.NOISE_RUNS], _groups(_noisy)),
    paths.LADDER: _groups(lambda study, scene, group: scene in study.settings.ladder.scenes),
    paths.LIVE_MODEL: _live,
    paths.STABILITY: _scenes(lambda study: study.settings.stability.scenes),
    paths.REQUESTED_TOLERANCES: _requested,
    paths.ALTERNATIVES: _sized(lambda study: study.settings.alternatives.scenes),
    paths.ALTERNATIVE_TIMES: _sized(lambda study: study.settings.alternatives.scenes),
}
