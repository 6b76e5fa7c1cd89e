"""Make repeated runs, an ablation of methods, and runs with bases of rounding errors."""

import logging
from collections.abc import Iterable, Sequence
from typing import Annotated

import pandas as pd
from pydantic import Field

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.scene import SceneConfig
from pdrom.reduction import snapshots as sets
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec
from study.artifact import paths
from study.artifact.reads import Settings
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row
from study.experiments.repetitions import ladder, noise
from study.experiments.repetitions.runs import ReducedRuns, Repetitions, Varied

log = logging.getLogger(__name__)
COLUMNS = [
    "scene", "group", "method", "r", "varied", "seed", "gain", "finite", "error",
]  # fmt: skip


class Cell(ConfigModel):
    """Settings of runs that are repeated.

    sizes : basis sizes of the runs
    varied : differences of repetitions: initial positions, training frames, or test trajectories
    """

    sizes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)]
    varied: tuple[Varied, ...] = ("start", "training")


class Cells(Cell):
    """Runs to repeat: every method at every size, for each reduced group of each of ``scenes``."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]


class RepetitionSection(Repetitions):
    """Section ``repetitions`` of the configuration; ``cells`` lists the runs to repeat."""

    cells: tuple[Cells, ...] = ()


class Repeated(Cell):
    """A method, with its specification, to be repeated in the scene and group of the job."""

    method: str
    spec: MethodSpec


class Options(ConfigModel):
    """Settings for a scene and group; ``own_ladder`` or ``own_noise`` None: no such runs."""

    scene: SceneConfig
    repetitions: Repetitions
    repeated: tuple[Repeated, ...]
    own_ladder: ladder.Ladder | None
    own_noise: noise.NoiseRuns | None
    noise_methods: dict[str, MethodSpec]
    horizon: kit.Horizon


@kit.experiment(
    "Repeated runs of {scene} with {group} reduced",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "snapshots": paths.SNAPSHOTS,
        "sensitivity": paths.SENSITIVITY,
        "settings": Settings(Options),
    },
    writes={
        "out": paths.REPETITIONS,
        "rungs": paths.LADDER,
        "noise": paths.NOISE,
        "noise_runs": paths.NOISE_RUNS,
    },
)
def repetitions(settings: Options, **files: paths.File) -> None:
    """Make repeated runs, runs of an ablation, and runs with bases of rounding errors only.

    All reduce one group of one scene. A table is empty if ``settings`` contain no runs of its kind.
    """
    labels: Row = dict(files["out"].labels)
    runs = ReducedRuns(
        labels["group"],
        sets.load_snapshots(files["snapshots"].path),
        Yardstick(kit.scene_of(settings.scene, files["mesh"]), kit.positions_of(files["fom"])),
        end=settings.horizon.frames(files["sensitivity"]),
    )
    short = runs.until_the_end()
    rows = []
    for own in settings.repeated:
        for varied in own.varied:
            cell = {**labels, "method": own.method, "varied": varied}
            if varied == "motions":
                found = list(runs.on_motions(own.spec, own.sizes))
            else:
                found = short.repeat(own.spec, own.sizes, varied, settings.repetitions)
            rows += [cell | row for row in found]
        log.info("%s", own.method)
    _write(rows, COLUMNS, files["out"])
    climbed = ladder.climb(runs, short, settings.own_ladder) if settings.own_ladder else ()
    counts = ["blowup_frame", "repetitions", "entries"]
    _write((labels | row for row in climbed), ladder.COLUMNS, files["rungs"], counts)
    reduced: list[Row] = []
    with write_hdf5(files["noise_runs"].path) as file:
        if (asked := settings.own_noise) is not None:
            given = short.full.scene, runs.group, asked, settings.noise_methods
            reduced = noise.noisy_runs(*given, file)
    counts = ["frames", "blowup_frame"]
    _write((labels | row for row in reduced), noise.COLUMNS, files["noise"], counts)


def _write(
    rows: Iterable[Row], columns: list[str], file: paths.File, whole: Sequence[str] = ()
) -> None:
    """Write a table; its columns ``whole`` contain integers or are empty."""
    table = pd.DataFrame(list(rows), columns=columns)
    write_table(table.astype(dict.fromkeys(whole, "Int64")), file.path)
