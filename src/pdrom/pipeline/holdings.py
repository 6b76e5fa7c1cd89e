"""Which files of each kind a configuration holds."""

from collections.abc import Callable, Iterator

from pdrom.core import paths
from pdrom.core.paths import Place
from pdrom.core.reads import Preferred
from pdrom.pipeline.scenes import not_taken
from pdrom.pipeline.study import Study

Labels = dict[str, str]


def labels_of(study: Study, place: Place) -> list[Labels]:
    """Labels of every file of a kind, in the order of the configuration, without repetition."""
    found = HELD[place](study)
    return list({tuple(labels.items()): labels for labels in found}.values())


def paths_of(study: Study, place: Place, results: str) -> list[str]:
    """Paths of every file of a kind below the folder ``results``."""
    return [place.at(results, **labels) for labels in labels_of(study, place)]


def preferred_paths(study: Study, read: Preferred, results: str) -> list[str]:
    """One path for each set of a kind's other labels, see `Preferred`."""
    chosen: dict[tuple[str, ...], Labels] = {}
    for labels in labels_of(study, read.place):
        others = tuple(value for label, value in labels.items() if label != read.label)
        if others not in chosen or labels[read.label] == read.value:
            chosen[others] = labels
    return [read.place.at(results, **labels) for labels in chosen.values()]


def _meshes(study: Study) -> Iterator[Labels]:
    for mesh in study.meshes:
        yield {"mesh": mesh}


def _runs(study: Study) -> Iterator[Labels]:
    for scene in study.scenes:
        for run in ("train", "heldout"):
            yield {"scene": scene, "run": run}


def _scenes(study: Study) -> Iterator[Labels]:
    for scene in study.scenes:
        yield {"scene": scene}


def _experiments(study: Study) -> Iterator[Labels]:
    for scene, group in study.experiments:
        yield {"scene": scene, "group": group}


def _bases(study: Study) -> Iterator[Labels]:
    for scene, group in study.experiments:
        for method in study.methods.values():
            yield {"scene": scene, "group": group, "basis": method.basis_id}


def _methods(study: Study) -> Iterator[Labels]:
    for scene, group in study.experiments:
        for method in study.methods:
            yield {"scene": scene, "group": group, "method": method}


def _among(select: Callable[[Study], tuple[str, ...]]) -> Callable[[Study], Iterator[Labels]]:
    """The scenes of a list of the configuration, as far as the study holds them."""

    def held(study: Study) -> Iterator[Labels]:
        listed = select(study)
        for scene in study.scenes:
            if scene in listed:
                yield {"scene": scene}

    return held


def _ladders(study: Study) -> Iterator[Labels]:
    for scene, group in study.experiments:
        if scene in study.ladder.scenes:
            yield {"scene": scene, "group": group}


def _repetitions(study: Study) -> Iterator[Labels]:
    cells = study.settings.repetitions.cells
    for scene, group in study.experiments:
        if any(scene in cell.scenes for cell in cells):
            yield {"scene": scene, "group": group}


def _noise(study: Study) -> Iterator[Labels]:
    cases = study.settings.noise.cases
    for scene, group in study.experiments:
        if cases.get(scene) == group:
            yield {"scene": scene, "group": group}


def _published_choices(study: Study) -> Iterator[Labels]:
    cases = study.settings.published_choices.cases
    for scene, group in study.experiments:
        if any((case.scene, case.group) == (scene, group) for case in cases):
            yield {"scene": scene, "group": group}


Factors = dict[str, tuple[float, ...]]


def _sized(select: Callable[[Study], Factors]) -> Callable[[Study], Iterator[Labels]]:
    """The mesh sizes of scenes that the configuration lists, as far as the study holds them."""

    def held(study: Study) -> Iterator[Labels]:
        for scene, factors in select(study).items():
            if scene in study.scenes:
                for factor in factors:
                    yield {"scene": scene, "factor": f"{factor:g}"}

    return held


_sizes = _sized(lambda study: study.settings.scaling.scenes)


def _online(study: Study) -> Iterator[Labels]:
    for scene in study.online:
        yield {"scene": scene}


def _one(study: Study) -> Iterator[Labels]:
    """The only file of its kind, which no scene labels."""
    yield {}


def _subspaces(study: Study) -> Iterator[Labels]:
    """The listed scenes, or all; none where no model is asked for, or none takes an effect."""
    section = study.settings.subspace
    for scene, config in study.scenes.items() if section.bases and section.sizes else ():
        if scene in section.scenes or (not section.scenes and not not_taken(config)):
            yield {"scene": scene}


def _companions(study: Study) -> Iterator[Labels]:
    for scene, config in study.scenes.items():
        if not not_taken(config):
            yield {"scene": scene}


HELD: dict[Place, Callable[[Study], Iterator[Labels]]] = {
    paths.MESH: _meshes,
    paths.FULL_ORDER: _runs,
    paths.TRAIN: _scenes,
    paths.HELDOUT: _scenes,
    paths.SENSITIVITY: _scenes,
    paths.CONTRIBUTIONS: _scenes,
    paths.ITERATIONS: _scenes,
    paths.SNAPSHOTS: _experiments,
    paths.BASIS: _bases,
    paths.SAMPLING: _methods,
    paths.RECONSTRUCTION: _methods,
    paths.RERUNS: _methods,
    paths.RERUNS_TRAIN: _methods,
    paths.RERUNS_HELDOUT: _methods,
    paths.SUBSPACES: _subspaces,
    paths.SUBSPACES_TRAIN: _subspaces,
    paths.SUBSPACES_HELDOUT: _subspaces,
    paths.POSITION_BASES: _subspaces,
    paths.COMPANION: _companions,
    paths.ESTIMATES: _companions,
    paths.COMPANION_TIMES: _companions,
    paths.SUBSPACES_SECONDS: _subspaces,
    paths.BOUNDS: _scenes,
    paths.LADDER: _ladders,
    paths.REPETITIONS: _repetitions,
    paths.REPEATED_FRAMES: _repetitions,
    paths.NOISE: _noise,
    paths.NOISE_RUNS: _noise,
    paths.PUBLISHED_CHOICES: _published_choices,
    paths.STABILITY: _among(lambda study: study.settings.stability.scenes),
    paths.SUBSPACE_ABLATION: _among(lambda study: study.ablation.scenes),
    paths.TIMINGS: _scenes,
    paths.BREAK_EVEN: _scenes,
    paths.BREAK_EVEN_SIZED: _sizes,
    paths.EFFECTS: _scenes,
    paths.EFFECTS_SIZED: _sizes,
    paths.LEFT_OUT: _scenes,
    paths.SCALING: _sizes,
    paths.ONLINE: _online,
    paths.ONLINE_MODELS: _online,
    paths.FRAME_TIMES: _one,
    paths.PROJECTION_SECONDS: _one,
    paths.ALTERNATIVES: _sized(lambda study: study.settings.alternatives.scenes),
    paths.HARD_CASES: _one,
    paths.KERNEL_ACCURACY: _one,
    paths.GUARD: _one,
    paths.OFFLINE: _one,
    paths.RATES: _one,
    paths.WORK: _one,
}
