"""Runs of the scenes of the preprint, reduced: a full-order run beside the reduced ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from pdrom.model.mesh.types import Mesh, load_mesh
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.camera import obstacles
from pdrom.view.panels import NOTHING_RAN, Row, RunPanel, draw_rows, run_panel, shared_window
from pdrom.view.read import choose_ranks, positions_at, rerun_infos
from study.artifact.paths import MESH, NOISE_RUNS, RERUNS, TRAIN, File
from study.artifact.reads import EachOf, Every, Read, Settings, TableOf
from study.experiments.kit.settings import Horizon
from study.figures.kit.declaration import figure
from study.figures.kit.options import Drawn, Experiment, NothingToDraw, ReducedRuns
from study.figures.sensitivity_floor import FLOORS, Floors

NOISY = {"all": "all axes", "plane": "in the plane", "vertex": "one vertex across"}
WRONG = 0.1  # of the motion: a run whose error is larger has failed, as one that does not start


@dataclass(frozen=True)
class Runs:
    """Files of the runs of every experiment, and of their scenes.

    meshes, full_order, sensitivity : files of every scene
    reruns : files of every experiment and method
    """

    horizon: Horizon
    meshes: Sequence[File]
    full_order: Sequence[File]
    reruns: Sequence[File]
    sensitivity: Sequence[File]

    @cached_property
    def floors(self) -> Floors:
        """Sensitivity floors of the scenes."""
        return Floors(self.sensitivity, self.horizon)

    def mesh(self, experiment: Experiment) -> Mesh:
        """Mesh of an experiment's scene."""
        return load_mesh(experiment.path(self.meshes))

    def at(
        self, experiment: Experiment, instants: tuple[float, ...], end: int | None = None
    ) -> tuple[list[int], np.ndarray]:
        """Frames of the full-order run, and its positions there, see `positions_at`."""
        return positions_at(experiment.path(self.full_order), instants, end)


def obstacles_of(experiment: Experiment, positions: np.ndarray) -> list[Mesh] | None:
    """Obstacles near ``positions`` (F, N, 3) m; None for a floor alone, which has a shadow."""
    bodies = obstacles(positions, experiment.effects)
    floor = any(effect.effect == "floor" for effect in experiment.effects)
    return None if floor and len(bodies) == 1 else bodies


RUNS: dict[str, Read] = {
    "drawn": Settings(Drawn),
    "meshes": EachOf(MESH, "experiments"),
    "full_order": EachOf(TRAIN, "experiments"),
    "reruns": EachOf(RERUNS, "runs"),
    **FLOORS,
}
COMPARED = (
    "full order against reduced projections, by basis size. The grey outline is the full-order run "
    "at the same instant; a framed picture is drawn to the smaller scale given below it."
)
RowsOf = Callable[[ReducedRuns, Drawn, Runs, Experiment], list[Row]]


def experiment_rows(
    options: ReducedRuns, drawn: Drawn, runs: Runs, experiment: Experiment
) -> list[Row]:
    """A row per method; a single one that says so where no method has anything to reduce."""
    camera = options.camera(experiment)
    colour = style.surface_colour(drawn.looks[experiment.group][0])
    frames, full = runs.at(experiment, options.frames[-1:])
    bodies = obstacles_of(experiment, full)
    frame, mesh = frames[0], runs.mesh(experiment)
    when = runs.floors.instant(experiment.scene, frame).replace(", ", "\n")
    reference = RunPanel("full order", style.FULL_ORDER, full[0], reference=True, obstacles=bodies)
    reduced = {}
    for method in drawn.methods:
        path = experiment.path(runs.reruns, method=method)
        infos = choose_ranks(rerun_infos(path), options.ranks)
        panels = [run_panel(path, i, frame, colour=colour, title=i.title) for i in infos]
        reduced[method] = [replace(p, obstacles=bodies).seen_by(camera) for p in panels]
    everything = [panel for panels in reduced.values() for panel in panels]
    window = shared_window(camera, full[0], everything)
    reference = reference.seen_by(camera)
    if all(panel.positions is None and not panel.failure for panel in everything):
        label = f"{experiment.title}\nany method\n{when}"
        return [Row(label, mesh, [reference], [window], full, camera, NOTHING_RAN)]
    return [
        Row(
            f"{experiment.title}\n{drawn.title(method)}\n{when}",
            mesh,
            [reference, *panels],
            [window] * (len(panels) + 1),
            np.repeat(full, len(panels) + 1, axis=0),
            camera,
        )
        for method, panels in reduced.items()
    ]


def draw_experiments(
    options: ReducedRuns, drawn: Drawn, runs: Runs, rows_of: RowsOf = experiment_rows
) -> Figure:
    """Draw a row per experiment and method: the full-order run, then the reduced ones by size.

    All pictures of an experiment show the same instant, the last one of ``options.frames``,
    with the same camera; one that does not fit is framed and its scale is given. The grey outline
    is the full-order run. Experiments and methods are those ``drawn``.

    rows_of : rows of one experiment
    """
    if not drawn.experiments or not drawn.methods:
        raise NothingToDraw(options.words())
    rows = [row for each in drawn.experiments for row in rows_of(options, drawn, runs, each)]
    return draw_rows(rows)


@figure(
    title="The bar, reduced",
    caption=f"Bars with tetrahedral constraints: {COMPARED}",
    reads=RUNS,
    options=ReducedRuns,
)
def bar_runs(options: ReducedRuns, drawn: Drawn, horizon: Horizon, **files: list[File]) -> Figure:
    """Draw full-order runs beside reduced ones, see `draw_experiments`."""
    return draw_experiments(options, drawn, Runs(horizon, **files))


@figure(
    number=5,
    title="Bending only, reduced",
    caption=(
        "Sheets with bending constraints only, near the end of the run: full order against "
        "reduced projections. The projections of a flat sheet are round-off: in the preprint's two "
        "scenes the basis is one of noise, and what it does depends on which axes the round-off "
        "of the start reaches (drawn is the first start of which some sizes run and others do "
        "not, or else the first; all are counted below the pictures and in the figure of "
        "reductions on bases of round-off). The curved sheet has projections that matter."
    ),
    reads={**RUNS, "noise": TableOf("noise"), "noise_runs": Every(NOISE_RUNS)},
    options=ReducedRuns,
)
def bending_runs(
    options: ReducedRuns,
    drawn: Drawn,
    horizon: Horizon,
    noise: pd.DataFrame,
    noise_runs: list[File],
    **files: list[File],
) -> Figure:
    """Draw reduced runs; where all projections are round-off, runs on bases of it, if any."""

    def rows_of(options: ReducedRuns, drawn: Drawn, runs: Runs, each: Experiment) -> list[Row]:
        found = experiment_rows(options, drawn, runs, each)
        own = noise[(noise.scene == each.scene) & (noise.group == each.group)]
        path = each.find(noise_runs)
        if found[0].note != NOTHING_RAN or path is None:
            return found
        return noise_rows(options, drawn, runs, each, own, path) or found

    return draw_experiments(options, drawn, Runs(horizon, **files), rows_of)


@figure(
    number=6,
    title="Springs only, reduced",
    caption=f"Sheets with edge springs only: {COMPARED}",
    reads=RUNS,
    options=ReducedRuns,
)
def spring_runs(
    options: ReducedRuns, drawn: Drawn, horizon: Horizon, **files: list[File]
) -> Figure:
    """Draw full-order runs beside reduced ones, see `draw_experiments`."""
    return draw_experiments(options, drawn, Runs(horizon, **files))


@figure(
    number=7,
    title="Triangle strain only, reduced",
    caption=f"Sheets with triangle strain only: {COMPARED}",
    reads=RUNS,
    options=ReducedRuns,
)
def strain_runs(
    options: ReducedRuns, drawn: Drawn, horizon: Horizon, **files: list[File]
) -> Figure:
    """Draw full-order runs beside reduced ones, see `draw_experiments`."""
    return draw_experiments(options, drawn, Runs(horizon, **files))


def noise_rows(
    options: ReducedRuns,
    drawn: Drawn,
    runs: Runs,
    experiment: Experiment,
    table: pd.DataFrame,
    path: str,
) -> list[Row]:
    """A row per drawn method and kind of start; below each picture how many of all starts fail.

    Kinds of which as many fail at every size share a row, with a run of the first of them.

    Parameters
    ----------
    table : rows of the table ``noise`` of this ``experiment``
    path : file of its ``runs`` on bases of round-off
    """
    camera = options.camera(experiment)
    colour = style.surface_colour(drawn.looks[experiment.group][0])
    frames, full = runs.at(experiment, options.frames[-1:])
    mesh = runs.mesh(experiment)
    when = runs.floors.instant(experiment.scene, frames[0]).replace(", ", "\n")
    reference = RunPanel("full order", style.FULL_ORDER, full[0], reference=True).seen_by(camera)
    rows = []
    for method in drawn.methods:
        for counts, kinds in _alike(table[table.method == method]).items():
            fail = dict(counts)
            panels = [
                replace(
                    run_panel(path, info, frames[0], colour=colour, title=info.title),
                    remark=fail[info.r],
                )
                for info in rerun_infos(path, f"{kinds[0]}/{method}")
                if info.r in fail
            ]
            panels = [panel.seen_by(camera) for panel in panels]
            label = f"{experiment.title}\n{drawn.title(method)}"
            start = ", ".join(NOISY[kind] for kind in kinds)
            rows.append(
                Row(
                    f"{label}\nnoise: {start}\n{when}",
                    mesh,
                    [reference, *panels],
                    [shared_window(camera, full[0], panels)] * (len(panels) + 1),
                    np.repeat(full, len(panels) + 1, axis=0),
                    camera,
                )
            )
    return rows


def _alike(table: pd.DataFrame) -> dict[tuple[tuple[int, str], ...], list[str]]:
    """(r, how many of all starts fail) of every size -> kinds of starts with these counts."""
    table = table[table.r <= table["rank"]]
    failed = ~(table.relative_error <= WRONG)
    kinds: dict[tuple[tuple[int, str], ...], list[str]] = {}
    for kind, of_kind in failed.groupby(table.noisy_axes, sort=False):
        sizes = of_kind.groupby(table.r)
        counts = ((int(r), f"{one.sum()} of {len(one)} starts fail") for r, one in sizes)
        kinds.setdefault(tuple(counts), []).append(str(kind))
    return kinds
