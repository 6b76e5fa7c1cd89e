"""Compute settings of a job from the configuration; `DERIVED` lists their names and functions.

All other settings are keys or sections of the configuration. If a job's function annotates its
parameter for a section with a base class of the section's class, the job depends only on the
settings that this base class declares.

Functions in `DERIVED` get ``labels``, which maps "scene", "group" ... to the values of the job. For
a figure, it maps "figure" to the figure's name, from which its scenes and methods follow.
"""

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects import EFFECTS
from pdrom.model.held_out import HeldOut
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from study.artifact import paths
from study.artifact.reads import Labels
from study.artifact.text import filled, to_tex
from study.experiments.frame_times import NamedScene, ProjectionCase, SubspaceCase
from study.experiments.kit.base import Horizon, OfScene
from study.experiments.repetitions.experiment import Cell, Repeated
from study.experiments.stability import Stability
from study.experiments.subspaces import JOINT, JointRows
from study.experiments.timing import SCALED
from study.figures.kit.declaration import Drawn, Experiment, Reduction, declarations
from study.paper.build import PAGES, Facts
from study.paper.source import source_files
from study.pipeline.folders import DEFAULT
from study.pipeline.study import Study, labels_of
from study.tables.kit.results import FAILED, FAR

# Basis in tables with one basis per group; if no method uses it, the basis of the first method.
USUAL_BASIS = "none-none-vectorised"


def _stability(study: Study, labels: Labels) -> Stability:
    """Return the section ``stability`` without sizes r for which the study has no samples."""
    section = study.settings.stability
    held = tuple(r for r in section.ranks if r in study.settings.ranks)
    return section.model_copy(update={"ranks": held})


def _usual_bases(study: Study, labels: Labels) -> list[paths.File]:
    """Return a basis file for each scene and group: of `USUAL_BASIS`, else of the first basis."""
    chosen: dict[tuple[str, str], Labels] = {}
    for held in labels_of(study, paths.BASIS):
        group = (held["scene"], held["group"])
        if group not in chosen or held["basis"] == USUAL_BASIS:
            chosen[group] = held
    return [paths.File("", dict(held)) for held in chosen.values()]


def _holds(study: Study, place: paths.Place, labels: Labels) -> bool:
    """Return whether the study makes a file of the kind ``place`` for these ``labels``."""
    return {name: labels[name] for name in place.labels} in labels_of(study, place)


def _of_scene(study: Study, place: paths.Place, labels: Labels) -> tuple[OfScene, ...]:
    """Return the job's scene in a tuple; () if the study makes no file ``place`` for it."""
    return (OfScene(scene=labels["scene"]),) if _holds(study, place, labels) else ()


def _joint_rows(study: Study, labels: Labels) -> tuple[JointRows, ...]:
    """Return `JointRows` of the scene's groups; () if the study lacks the scene or `JOINT`."""
    scene = labels["scene"]
    if JOINT not in study.methods or scene not in study.scenes:
        return ()
    spec = study.methods[JOINT]
    return tuple(
        JointRows(scene=scene, group=group, spec=spec) for group in study.scenes[scene].reduce
    )


def _named(scenes: Mapping[str, SceneConfig]) -> list[NamedScene]:
    return [NamedScene(scene=name, config=config) for name, config in scenes.items()]


def _subspace_cases(study: Study, labels: Labels) -> tuple[SubspaceCase, ...]:
    """Return the entries of ``frame_times.subspaces`` whose models the study computes."""
    held = {labels["scene"] for labels in labels_of(study, paths.SUBSPACES)}
    models = study.settings.subspace
    return tuple(
        case
        for case in study.settings.frame_times.subspaces
        if case.scene in held and case.method in models.methods(case.position_basis, case.k)
    )


def _projection_cases(study: Study, labels: Labels) -> tuple[ProjectionCase, ...]:
    """Return the entries of ``frame_times.projections`` whose samples the study computes."""
    held = labels_of(study, paths.SAMPLING)
    return tuple(
        case
        for case in study.settings.frame_times.projections
        if case.labels in held and case.r in study.settings.ranks
    )


def scaled_methods(study: Study, labels: Labels) -> dict[str, MethodSpec]:
    """Map names to the methods that are timed on meshes of increasing size."""
    return study.named_methods(SCALED, "scaling")


def _repeated(study: Study, labels: Labels) -> tuple[Repeated, ...]:
    """Return the runs to repeat in the job's scene, for each method in ``repetitions``."""
    cells = [c for c in study.settings.repetitions.cells if labels["scene"] in c.scenes]
    return tuple(
        Repeated(method=name, spec=spec, **cell.model_dump(include={*Cell.model_fields}))
        for cell in cells
        for name, spec in study.named_methods(cell.methods, "repetitions.cells").items()
    )


def _drawn(study: Study, labels: Labels) -> Drawn:
    """Return the scenes and methods that a figure names, or else those that fit the figure."""
    figure = declarations()[labels["figure"]]
    groups = {*figure.groups.split()}
    fitting = [
        name
        for name, config in study.scenes.items()
        if len(config.reduce) > figure.several and not (groups and groups.isdisjoint(config.reduce))
    ]
    scenes = [name for name in figure.scenes.split() if name in study.scenes] or fitting
    methods = [name for name in figure.methods.split() if name in study.methods] or study.methods
    found = [(name, study.scenes[name]) for name in scenes]
    specs = [(name, study.methods[name]) for name in methods]
    return Drawn(
        experiments=tuple(
            Experiment(
                scene=scene, group=group, mesh=config.mesh.identifier, effects=config.effects,
                only=len(config.reduce) == 1,
            )
            for scene, config in found
            for group in config.reduce
        ),
        reductions={name: Reduction(title=spec.title, rows=spec.rows) for name, spec in specs},
    )  # fmt: skip


def _facts(study: Study, labels: Labels) -> Facts:
    """Return the contents of the manuscript besides results: captions, settings, page limits."""
    own = study.is_own
    return Facts(
        captions={
            name: f"{to_tex(each.title)}. {to_tex(filled(each.caption, study.value))}"
            for name, each in declarations().items()
        },
        part=None if study.is_full or own else study.configuration,
        full_study=study.configuration if own else DEFAULT,
        pages={} if own else PAGES,
        tables={
            "study": [_numbers(study)],
            "methods": [
                {"method": name, **method.model_dump(mode="json")}
                for name, method in study.methods.items()
            ],
            "scenes": [_scene(study, name) for name in study.scenes],
        },
    )


def _numbers(study: Study) -> dict[str, Any]:
    settings = study.settings
    return {
        "scenes": len(study.scenes),
        "experiments": len(study.experiments),
        "threshold": settings.sensitivity.threshold,
        "perturbation": settings.sensitivity.reference,
        "seeds": len(settings.sensitivity.seeds),
        "noise_repetitions": settings.noise.repetitions,
        "repeats": settings.timing.repeats,
        "timed_frames": settings.timing.frames,
        "processes": settings.frame_times.processes,
        "process_frames": settings.frame_times.frames,
        "blowup_extent": BLOWUP_EXTENT,
        "ranks": ", ".join(str(r) for r in settings.ranks),
        "wrong": settings.stability.wrong,
        "left": settings.stability.left,
        "tolerance": settings.reference.tolerance,
        "opponent_frames": settings.alternatives.frames,
        "opponent_processes": settings.alternatives.processes,
        "far": FAR,
        "accurate": FAILED,
        "carry": HeldOut().carry,
    }


def _scene(study: Study, name: str) -> dict[str, Any]:
    config, (vertices, elements) = study.scenes[name], study.sizes[name]
    weights = {e.effect: e.weight for e in config.effects if isinstance(e, GroupConfig)}
    return {
        "scene": name,
        "groups": ", ".join(f"{group} ({weights[group]:g})" for group in config.groups),
        "vertices": vertices,
        "elements": elements,
        **{k: getattr(config, k) for k in ("frames", "iterations", "time_step", "vertex_mass")},
    }


def _elements(scene: SceneConfig) -> str:
    """Return the name of the largest elements on which constraints of ``scene`` act."""
    cells = {EFFECTS.load(group).cells for group in scene.groups}
    kinds = {"tetrahedron": "tetrahedra", "triangle": "triangles"}
    return next((words for cell, words in kinds.items() if cell in cells), "springs")


DERIVED: dict[str, Callable[[Study, Labels], Any]] = {
    # recorded rows describe scenes of the full study
    "recorded": lambda study, _: study.settings.recorded and not study.is_alone,
    "scene": lambda study, labels: study.scene(labels["scene"]),
    "title": lambda study, labels: study.titles[study.scene(labels["scene"]).name],
    "mesh": lambda study, labels: study.mesh(labels["mesh"]),
    "method": lambda study, labels: study.methods[labels["method"]],
    "basis": lambda study, labels: study.basis(labels["basis"]),
    "methods": lambda study, labels: study.methods,
    "every_method": lambda study, labels: study.every_method,
    "scene_time_steps": lambda study, _: {k: v.time_step for k, v in study.scenes.items()},
    "scene_iterations": lambda study, _: {k: v.iterations for k, v in study.scenes.items()},
    "compared_elements": lambda study, _: {
        name: _elements(study.scene(name)) for name in study.settings.alternatives.scenes
    },
    "usual_bases": _usual_bases,
    "own_ladder": lambda study, labels: (
        study.settings.ladder if _holds(study, paths.LADDER, labels) else None
    ),
    "own_noise": lambda study, labels: (
        study.settings.noise if _holds(study, paths.NOISE, labels) else None
    ),
    "horizon": lambda study, _: Horizon(
        perturbation=study.settings.sensitivity.reference,
        threshold=study.settings.sensitivity.threshold,
    ),
    "stability": _stability,
    "scaled_methods": scaled_methods,
    "noise_methods": lambda study, labels: study.named_methods(
        study.settings.noise.methods, "noise.methods"
    ),
    "repeated": _repeated,
    "with_subspaces": lambda study, labels: _of_scene(study, paths.SUBSPACES, labels),
    "with_online_models": lambda study, labels: _of_scene(study, paths.ONLINE_MODELS, labels),
    "joint_rows": _joint_rows,
    "timed_scenes": lambda study, _: _named(study.scenes),
    "large_scenes": lambda study, _: _named(study.online),
    "subspace_cases": _subspace_cases,
    "projection_cases": _projection_cases,
    "projection_methods": lambda study, labels: {
        case.method: study.methods[case.method] for case in _projection_cases(study, labels)
    },
    "drawn": _drawn,
    # reduced groups that a figure shows, if the scene has models in position subspaces
    "drawn_subspaces": lambda study, labels: tuple(
        each
        for each in _drawn(study, labels).experiments
        if _holds(study, paths.SUBSPACES, {"scene": each.scene})
    ),
    # TeX files of paper and supplement
    "manuscript": lambda study, _: SimpleNamespace(sources=source_files(study.root, study.is_own)),
    "facts": _facts,
}
