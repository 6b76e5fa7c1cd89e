"""Settings that are derived from the configuration for a job, by the names that artifacts read.

A name that is not listed here is a key of the configuration. A setting of the type of a section's
base class gets the fields of that class only, so that a job depends on nothing else.
"""

from collections.abc import Callable, Mapping
from typing import Any

from pdrom.model.mesh.config import MeshConfig
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import BasisSpec, MethodSpec
from study.artifact import paths
from study.artifact.paths import Place
from study.experiments.frame_times import NamedScene, ProjectionCase, SubspaceCase
from study.experiments.kit.settings import Horizon, Rank
from study.experiments.live import JOINT, JointRows, OfScene
from study.experiments.repetitions import LadderSection, Noise, Repeated
from study.experiments.stability import Stability
from study.pipeline import figures, paper
from study.pipeline.contents import labels_of
from study.pipeline.study import Study

Labels = Mapping[str, str]


def _scene(study: Study, labels: Labels) -> SceneConfig:
    return study.scene(labels["scene"])


def _title(study: Study, labels: Labels) -> str:
    return study.titles[study.scene(labels["scene"]).name]


def _mesh(study: Study, labels: Labels) -> MeshConfig:
    return study.mesh(labels["mesh"])


def _method(study: Study, labels: Labels) -> MethodSpec:
    return study.method(labels["method"])


def _basis(study: Study, labels: Labels) -> BasisSpec:
    """Specification of a basis by the first method that uses it."""
    return study.basis(labels["basis"])


def _horizon(study: Study, labels: Labels) -> Horizon:
    section = study.settings.sensitivity
    return Horizon(perturbation=section.reference, threshold=section.threshold)


def _stability(study: Study, labels: Labels) -> Stability:
    """The short runs at the sizes that the study has samples of."""
    section = study.settings.stability
    held = tuple(r for r in section.ranks if r in study.settings.ranks)
    return section.model_copy(update={"ranks": held})


def _held(place: Place) -> Callable[[Study, Labels], tuple[OfScene, ...]]:
    """The scene of a job if the study itself holds its file of a kind."""

    def held(study: Study, labels: Labels) -> tuple[OfScene, ...]:
        own = {"scene": labels["scene"]}
        return (OfScene(**own),) if own in labels_of(study, place) else ()

    return held


def _joint_rows(study: Study, labels: Labels) -> tuple[JointRows, ...]:
    """Joint rows of the reduced groups of a scene, as far as the study samples them."""
    scene = labels["scene"]
    if JOINT not in study.methods or scene not in study.scenes:
        return ()
    method = study.methods[JOINT]
    return tuple(
        JointRows(scene=scene, group=group, method=method) for group in study.scenes[scene].reduce
    )


def _timed_scenes(study: Study, labels: Labels) -> tuple[NamedScene, ...]:
    return tuple(NamedScene(scene=scene) for scene in study.scenes.values())


def _large_scenes(study: Study, labels: Labels) -> tuple[NamedScene, ...]:
    return tuple(NamedScene(scene=scene) for scene in study.online.values())


def _subspace_cases(study: Study, labels: Labels) -> tuple[SubspaceCase, ...]:
    """Cases whose models the study holds."""
    held = {labels["scene"] for labels in labels_of(study, paths.SUBSPACES)}
    models = study.settings.subspace
    return tuple(
        case
        for case in study.settings.frame_times.subspaces
        if case.scene in held and case.method in models.methods(case.position_basis, case.k)
    )


def _projection_cases(study: Study, labels: Labels) -> tuple[ProjectionCase, ...]:
    """Cases whose samplings the study holds."""
    held = labels_of(study, paths.SAMPLING)
    return tuple(
        case
        for case in study.settings.frame_times.projections
        if case.labels in held and case.r in study.settings.ranks
    )


def scaled_methods(study: Study, labels: Labels) -> dict[str, MethodSpec]:
    """Methods that ``study`` times on growing meshes, the same for all ``labels``.

    They need not be among its own.
    """
    section = study.settings.scaling
    found = study.named_methods([section.method], "scaling.method")
    return found | study.named_methods(section.breakeven.methods, "scaling.breakeven.methods")


def _repeated(study: Study, labels: Labels) -> tuple[Repeated, ...]:
    """The cells of a scene, a method after the other; the methods need not be among the study's."""
    cells = [c for c in study.settings.repetitions.cells if labels["scene"] in c.scenes]
    return tuple(
        Repeated(method=name, spec=spec, sizes=cell.sizes, varied=cell.varied)
        for cell in cells
        for name, spec in study.named_methods(cell.methods, "repetitions.cells").items()
    )


def _own_ladder(study: Study, labels: Labels) -> LadderSection | None:
    """The ladder of a group; None where no ladder is asked for."""
    return study.settings.ladder if dict(labels) in labels_of(study, paths.LADDER) else None


def _own_noise(study: Study, labels: Labels) -> Noise | None:
    """The runs on round-off of a group; None where none are asked for."""
    return study.settings.noise if dict(labels) in labels_of(study, paths.NOISE) else None


def _noise_methods(study: Study, labels: Labels) -> dict[str, MethodSpec]:
    """The methods of the noise runs; they need not be among the study's."""
    return study.named_methods(study.settings.noise.methods, "noise.methods")


def _projection_methods(study: Study, labels: Labels) -> dict[str, MethodSpec]:
    return {case.method: study.methods[case.method] for case in _projection_cases(study, labels)}


def _heldout_ranks(study: Study, labels: Labels) -> tuple[Rank, ...]:
    """Sizes that run on the first held-out motion: all, unless the configuration chooses."""
    chosen = study.settings.heldout_ranks
    return study.settings.ranks if chosen is None else chosen


DERIVED: dict[str, Callable[[Study, Labels], Any]] = {
    **figures.DERIVED,
    **paper.DERIVED,
    "scene": _scene,
    "title": _title,
    "mesh": _mesh,
    "method": _method,
    "methods": lambda study, labels: study.methods,
    "every_scene": lambda study, labels: study.scenes,
    "every_method": lambda study, labels: study.every_method,
    "scaled_methods": scaled_methods,
    "own_ladder": _own_ladder,
    "own_noise": _own_noise,
    "noise_methods": _noise_methods,
    "repeated": _repeated,
    "basis": _basis,
    "horizon": _horizon,
    "stability": _stability,
    "with_subspaces": _held(paths.SUBSPACES),
    "with_online_models": _held(paths.ONLINE_MODELS),
    "joint_rows": _joint_rows,
    "timed_scenes": _timed_scenes,
    "large_scenes": _large_scenes,
    "subspace_cases": _subspace_cases,
    "projection_cases": _projection_cases,
    "projection_methods": _projection_methods,
    "heldout_ranks": _heldout_ranks,
}
