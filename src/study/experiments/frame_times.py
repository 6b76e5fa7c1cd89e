"""Times of frames over several processes: one for every full-order run, and of quoted reductions.

Every process times everything in another random order. The full-order run of each scene is timed
twice, the second time as a control: what two identical runs differ by is no speed-up.
"""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.scene import SceneConfig
from pdrom.reduction.basis import basis_of
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import select
from pdrom.reduction.snapshots import load_snapshots
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Settings
from study.experiments.kit.declaration import experiment
from study.experiments.kit.fresh_process import (
    Projections,
    Request,
    Subspaces,
    TimedScene,
    in_fresh_process,
)
from study.experiments.kit.measurement import Protocol
from study.experiments.kit.settings import Count, Modes, PositionBasis, Repeats, Solver

log = logging.getLogger(__name__)

SECONDS_COLUMNS = ["scene", "group", "method", "r", "reduction_s"]


class SubspaceCase(ConfigModel):
    """A model of a position subspace whose speed-up is quoted."""

    scene: SceneName
    method: str
    position_basis: PositionBasis = "pod"
    k: Modes

    @property
    def labels(self) -> dict[str, str]:
        """Labels of the file that holds it."""
        return {"scene": self.scene}


class ProjectionCase(ConfigModel):
    """Reduced projections, positions unreduced, whose speed-up is quoted."""

    scene: SceneName
    group: str
    method: str
    r: Modes

    @property
    def labels(self) -> dict[str, str]:
        """Labels of its files."""
        return {"scene": self.scene, "group": self.group, "method": self.method}


class Processes(Protocol):
    """``processes`` that each time every run: ``frames``, ``warmup`` and ``repeats`` of each."""

    frames: Count = 4
    repeats: Repeats = 3
    processes: Count = 10


class FrameTimes(Processes):
    """Section ``frame_times``: the protocol, and the reductions whose speed-up is quoted.

    Full-order runs of all scenes are timed, and every model of the large ones.
    """

    subspaces: tuple[SubspaceCase, ...] = ()
    projections: tuple[ProjectionCase, ...] = ()


class NamedScene(ConfigModel):
    """A scene with the label of its files."""

    scene: SceneConfig

    @property
    def labels(self) -> dict[str, str]:
        """Labels of its files."""
        return {"scene": self.scene.name}


class Options(ConfigModel):
    """Settings of the times."""

    frame_times: Processes
    timed_scenes: tuple[NamedScene, ...]
    large_scenes: tuple[NamedScene, ...]
    subspace_cases: tuple[SubspaceCase, ...]
    projection_cases: tuple[ProjectionCase, ...]
    projection_methods: dict[str, MethodSpec]
    solver: Solver


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
def frame_times(
    meshes: list[File],
    subspaces: list[File],
    bases: list[File],
    samplings: list[File],
    snapshots: list[File],
    large: list[File],
    settings: Options,
    times: File,
    seconds: File,
) -> None:
    """Start the processes one after the other, and join what they measured."""
    asked = settings.frame_times
    scenes = (
        *_small(settings, meshes, _projections(settings, bases, samplings), subspaces),
        *_large(settings, large),
    )
    parts = []
    with TemporaryDirectory() as folder:
        for process in range(1, asked.processes + 1):
            request = Request(
                scenes=scenes,
                timing=Protocol(frames=asked.frames, warmup=asked.warmup, repeats=asked.repeats),
                solver=settings.solver,
                seed=process,
                result=str(Path(folder) / f"{process}.csv"),
            )
            parts.append(in_fresh_process(request, Path(folder)))
            log.info("process %d of %d", process, asked.processes)
    write_table(pd.concat(parts, ignore_index=True), times.path)
    rows = [
        (case.scene, case.group, case.method, case.r, _seconds(case, file, settings))
        for case, file in zip(settings.projection_cases, snapshots, strict=True)
    ]
    write_table(pd.DataFrame(rows, columns=SECONDS_COLUMNS), seconds.path)


def _small(
    settings: Options,
    meshes: list[File],
    projections: list[tuple[str, Projections]],
    subspaces: list[File],
) -> Iterator[TimedScene]:
    """Yield the study's scenes with their quoted reductions."""
    for named, mesh in zip(settings.timed_scenes, meshes, strict=True):
        name = named.scene.name
        yield TimedScene(
            scene=named.scene,
            mesh=mesh.path,
            projections=tuple(own for scene, own in projections if scene == name),
            subspaces=_subspaces(name, settings.subspace_cases, subspaces),
        )


def _large(settings: Options, large: list[File]) -> Iterator[TimedScene]:
    for named, models in zip(settings.large_scenes, large, strict=True):
        yield TimedScene(scene=named.scene, subspaces=Subspaces(path=models.path))


def _projections(
    settings: Options, bases: list[File], samplings: list[File]
) -> list[tuple[str, Projections]]:
    cases = zip(settings.projection_cases, bases, samplings, strict=True)
    return [
        (
            case.scene,
            Projections(
                group=case.group,
                method=case.method,
                r=case.r,
                spec=settings.projection_methods[case.method],
                basis=basis.path,
                sampling=sampling.path,
            ),
        )
        for case, basis, sampling in cases
    ]


def _subspaces(
    scene: str, cases: Sequence[SubspaceCase], files: Sequence[File]
) -> Subspaces | None:
    own = [(c, f) for c, f in zip(cases, files, strict=True) if c.scene == scene]
    if not own:
        return None
    chosen = tuple((case.method, case.position_basis, case.k) for case, _ in own)
    return Subspaces(path=own[0][1].path, chosen=chosen)


def _seconds(case: ProjectionCase, snapshots: File, settings: Options) -> float:
    """Processor time of basis and sampling, s."""
    data, spec = load_snapshots(snapshots.path), settings.projection_methods[case.method]
    before = process_time()
    select(basis_of(data, spec), spec, case.r)
    return process_time() - before
