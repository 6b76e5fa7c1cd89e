"""Time frames of full-order runs and of reduced runs in several processes.

Every process times all runs, in another random order. As a control, the full-order run of each
scene is timed twice: speed-ups as small as the difference between these two times mean nothing.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import basis_of, load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import select
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import load_snapshots
from pdrom.reduction.subspace.model import load_models
from pdrom.reduction.timing import Variant, model_variant
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Settings
from study.experiments.kit.base import Modes, OfScene, PositionBasis, experiment
from study.experiments.kit.costs import variant
from study.experiments.kit.measurement import Processes, in_processes
from study.experiments.kit.models import Model, load_reduction

FULL, CONTROL, REDUCED = "full", "control", "reduced"
COLUMNS = [
    "process", "scene", "vertices", "frames", "role", "group", "method", "position_basis", "k", "r",
    "ms_per_frame", "vertices_ms", "processor_share",
]  # fmt: skip
SECONDS_COLUMNS = ["scene", "group", "method", "r", "reduction_s"]


class SubspaceCase(OfScene):
    """A model in a position subspace whose speed-up the manuscript cites."""

    method: str
    position_basis: PositionBasis = "pod"
    k: Modes


class ProjectionCase(OfScene):
    """Reduction of a group's projections (not of positions) whose speed-up the manuscript cites."""

    group: str
    method: str
    r: Modes


class FrameTimes(Processes):
    """Section ``frame_times`` of the configuration: reductions whose speed-up the manuscript cites.

    The full-order run of each scene and all models of section ``online`` are timed, too.
    """

    subspaces: tuple[SubspaceCase, ...] = ()
    projections: tuple[ProjectionCase, ...] = ()


class NamedScene(OfScene):
    """A scene and its name, which the paths of its files contain."""

    config: SceneConfig


class Options(ConfigModel):
    """Settings of the experiment `frame_times`."""

    frame_times: Processes
    timed_scenes: tuple[NamedScene, ...]
    large_scenes: tuple[NamedScene, ...]
    subspace_cases: tuple[SubspaceCase, ...]
    projection_cases: tuple[ProjectionCase, ...]
    projection_methods: dict[str, MethodSpec]


Models = list[tuple[dict[str, Any], Model]]


def variants(scene: Scene, models: Models, frames: int) -> Iterator[Variant]:
    """Yield the runs to time: full-order run, its repetition as a control, labelled ``models``."""
    config, frames = scene.config, min(frames, scene.config.frames)
    common = {"scene": config.name, "vertices": scene.mesh.vertices, "frames": config.frames}
    for role in (FULL, CONTROL):
        yield variant(scene, frames, {**common, "role": role})
    for own, model in models:
        sizes = {"group": "all", "r": model.elements_evaluated(scene)}
        labels = {**common, "role": REDUCED, **sizes, **own}
        yield model_variant(labels, scene, model, frames)


@experiment(
    "Times of frames in several processes",
    reads={
        "meshes": EachOf(paths.MESH, "timed_scenes"),
        "subspaces": EachOf(paths.SUBSPACES, "subspace_cases"),
        "bases": EachOf(paths.BASIS, "projection_cases"),
        "samplings": EachOf(paths.SAMPLING, "projection_cases"),
        "snapshots": EachOf(paths.SNAPSHOTS, "projection_cases"),
        "large": EachOf(paths.ONLINE_MODELS, "large_scenes"),
        "settings": Settings(Options),
    },
    writes={"times": paths.FRAME_TIMES, "seconds": paths.PROJECTION_SECONDS},
    alone=True,
)
def frame_times(settings: Options, times: File, seconds: File, **files: list[File]) -> None:
    """Time frames in one process after the other, and the selection of samples; write all times."""
    asked = settings.frame_times
    meshes = zip(settings.timed_scenes, files["meshes"], strict=True)
    scenes = {own.scene: Scene.build(own.config, load_mesh(mesh.path)) for own, mesh in meshes}
    models: dict[str, Models] = {name: [] for name in scenes}
    rows = []
    given = (files[name] for name in ("bases", "samplings", "snapshots"))
    for own, basis, sampling, data in zip(settings.projection_cases, *given, strict=True):
        spec = settings.projection_methods[own.method]
        reduction = load_reduction(load_basis(basis.path), sampling.path, spec, r=own.r)
        labels = own.model_dump() | {"position_basis": "full"}
        models[own.scene].append((labels, ProjectionModel(own.group, reduction)))
        known = load_snapshots(data.path)
        before = process_time()
        select(basis_of(known, spec), spec, own.r)
        rows.append((*own.model_dump().values(), process_time() - before))
    for case, file in zip(settings.subspace_cases, files["subspaces"], strict=True):
        wanted, held = case.model_dump(exclude={"scene"}), load_models(file.path)
        models[case.scene] += [each for each in held if each[0] == wanted]
    # time all models in the file of a large scene, even if ``timed_scenes`` also lists the scene
    for named, file in zip(settings.large_scenes, files["large"], strict=True):
        if named.scene not in scenes:
            scenes[named.scene] = Scene.build(named.config, named.config.mesh.build(Path()))
        models.setdefault(named.scene, []).extend(load_models(file.path))
    timed = [partial(variants, scenes[name], models[name], asked.frames) for name in scenes]
    table = pd.DataFrame(in_processes(timed, asked), columns=COLUMNS)
    write_table(table.astype({"k": "Int64", "r": "Int64"}), times.path)
    write_table(pd.DataFrame(rows, columns=SECONDS_COLUMNS), seconds.path)
