"""Pictures of reduced runs and full-order runs in the scenes of the preprint."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5
from pdrom.model.held_out import FIRST
from pdrom.model.mesh.types import Mesh, load_mesh
from pdrom.view import panels as view
from pdrom.view import style
from pdrom.view.artists import Figure, ScalarMappable
from pdrom.view.camera import Camera, obstacles
from pdrom.view.panels import Row, RunPanel
from study.artifact import words
from study.artifact.paths import HELDOUT, MESH, NOISE_RUNS, RERUNS, SUBSPACES, TRAIN, File
from study.artifact.reads import EachOf, Every, Read, TableOf
from study.experiments.kit.base import Horizon
from study.experiments.reruns import TEST_FRAMES
from study.figures.kit.declaration import GROUPS, METHODS, Drawn, Experiment, camera_of, figure
from study.figures.kit.elements import magnitudes
from study.figures.kit.read import choose_ranks, positions_at, rerun_infos
from study.figures.sensitivity_floor import FLOORS, floors_of
from study.tables.errors import VOLUMES

NOISY = {"all": "all axes", "plane": "in the plane", "vertex": "plane and one vertex"}
NOTHING_RAN = "not run: the projections are rounding errors, there is nothing to reduce"
WRONG = 0.1  # a run fails if its relative error exceeds this value, or if it blows up
DISTANCES = (1e-4, 1.0)  # limits of colours: distance to full-order run / longest side of mesh
FOOTER = 0.55  # height of the colour scale, inches
# Figure `teaser`: instant as a fraction of the run, number of modes r, limit of k, and tolerance.
INSTANT, MODES, TOLERANCE = 0.65, 20, "ecsw-1e-02"
TEASER_ROW = 1.5  # largest height of its rows, inches
Ranks = tuple[int | Literal["full"], ...]
PAIR = "deim-joint block-deim"
RANKS: Ranks = (6, 10, 20, "full")  # basis sizes; full stands for the numerical rank
Files = list[File]
RUNS: dict[str, Read] = {
    "meshes": EachOf(MESH, "drawn.experiments"),
    "full_order": EachOf(TRAIN, "drawn.experiments"),
    "reruns": EachOf(RERUNS, "drawn.runs"),
    **FLOORS,
}
COMPARED = """the preprint's selection (separate systems for x, y, z) distorts most simulations or
makes them blow up. Element-wise DEIM is closer to the full-order model. Pictures show one frame of
the training trajectory: the full-order model, then reduced simulations with growing basis size $r$.
Grey outline: full-order model. Red frame: picture at the smaller scale that is given below it.
"""


@dataclass(frozen=True)
class Shown:
    """Scene in one frame, with everything that is needed to draw runs in this frame.

    when : text with the number of the frame
    full : (1, N, 3) positions of the full-order run, m
    colour : RGB colour of the reduced runs
    bodies : meshes of obstacles that are drawn; None without obstacles
    """

    experiment: Experiment
    mesh: Mesh
    camera: Camera
    frame: int
    when: str
    full: np.ndarray
    colour: tuple[float, float, float]
    bodies: list[Mesh] | None

    def row(self, label: str, panels: list[RunPanel], seen: list[RunPanel]) -> Row:
        """Return a row of pictures: the full-order run, then ``panels``.

        The row has the title of the experiment, with ``label`` below. Its window contains the
        full-order run and the panels ``seen``. If none of these runs could start, because each
        basis size exceeds the rank, a note replaces the panels.
        """
        note = None
        if not any(panel.began for panel in seen):
            note, panels = NOTHING_RAN, [panel for panel in panels if panel.began]
        window = view.shared_window(self.camera, self.full[0], seen)
        first = RunPanel("full-order model", style.FULL_ORDER, self.full[0], reference=True)
        panels = [replace(panel, obstacles=self.bodies) for panel in (first, *panels)]
        label, windows = f"{self.experiment.title}\n{label}", [window] * len(panels)
        ghosts = np.repeat(self.full, len(panels), axis=0)
        return Row(label, self.mesh, panels, windows, ghosts, self.camera, note)


@dataclass(frozen=True)
class Runs:
    """Inputs of pictures of runs: files per scene; ``reruns``: per scene, group and method."""

    drawn: Drawn
    horizon: Horizon
    ranks: Ranks
    frames: tuple[float, ...]  # instants that are drawn, as fractions of the run
    meshes: Files
    full_order: Files
    reruns: Files
    sensitivity: Files

    @cached_property
    def ends(self) -> dict[str, int | None]:
        """Horizon of each scene; None if the scene is predictable to its last frame."""
        floors = floors_of(self.sensitivity, self.horizon)
        return {scene: end for scene, (_, end) in floors.items()}

    def shown(self, experiment: Experiment) -> Shown:
        """Return the scene of ``experiment`` at the last of the instants."""
        (frame,), full = positions_at(experiment.find(self.full_order), self.frames[-1:])
        end = self.ends[experiment.scene]
        return Shown(
            experiment,
            load_mesh(experiment.find(self.meshes)),
            camera_of(experiment),
            frame,
            f"frame {frame}" if end is None or frame <= end else f"frame {frame}\nbeyond horizon",
            full,
            style.surface_colour(GROUPS[experiment.group][0]),
            obstacles_of(experiment, full),
        )

    def reduced(self, shown: Shown) -> dict[str, list[RunPanel]]:
        """Return method -> panels of its reduced runs, one for each basis size in `ranks`."""
        found = {}
        for method in self.drawn.methods:
            path = shown.experiment.find(self.reruns, method=method)
            infos = choose_ranks(rerun_infos(path), self.ranks)
            found[method] = [info.panel(shown.frame, shown.colour) for info in infos]
        return found

    def rows(self, experiment: Experiment) -> list[Row]:
        """Return a row for each method, or one row with a note if no reduced run could start."""
        shown = self.shown(experiment)
        reduced = self.reduced(shown)
        seen = [panel for panels in reduced.values() for panel in panels]
        rows = [
            shown.row(f"{self.drawn.title(method)}\n{shown.when}", panels, seen)
            for method, panels in reduced.items()
        ]
        return [shown.row(f"any method\n{shown.when}", [], seen)] if rows[0].note else rows

    def draw(self) -> Figure:
        """Draw a row for each scene and method: the full-order run, then reduced runs by size."""
        return view.draw_rows([row for each in self.drawn.experiments for row in self.rows(each)])


def obstacles_of(experiment: Experiment, positions: np.ndarray) -> list[Mesh] | None:
    """Return obstacles near ``positions`` (F, N, 3) m; None if only a floor (drawn as shadow)."""
    bodies = obstacles(positions, experiment.effects)
    floor = any(effect.effect == "floor" for effect in experiment.effects)
    return None if floor and len(bodies) == 1 else bodies


@figure(
    title="Bars: reduced projections", more=COMPARED, reads=RUNS,
    scenes="bar_release bar_twist torus_release starfish_twist", methods=PAIR,
    groups=" ".join(VOLUMES),
)  # fmt: skip
def bar_runs(drawn: Drawn, horizon: Horizon, **files: Files) -> Figure:
    """In bars of tetrahedra,"""
    return Runs(drawn, horizon, RANKS, (0.65,), **files).draw()


@figure(
    number=6, title="Springs only: reduced projections", more=COMPARED, reads=RUNS,
    scenes="spring_stretch spring_twist ball_shell", methods=PAIR, groups="spring",
)  # fmt: skip
def spring_runs(drawn: Drawn, horizon: Horizon, **files: Files) -> Figure:
    """In sheets with springs only,"""
    return Runs(drawn, horizon, RANKS, (0.3,), **files).draw()


@figure(
    number=7, title="Triangle strain only: reduced projections", more=COMPARED, reads=RUNS,
    scenes="strain_stretch strain_twist strain_poke disc_strain", methods=PAIR,
    groups="strain area",
)  # fmt: skip
def strain_runs(drawn: Drawn, horizon: Horizon, **files: Files) -> Figure:
    """In sheets with strain on triangles only,"""
    return Runs(drawn, horizon, RANKS, (0.3,), **files).draw()


@figure(
    number=5, title="Bending only: reduced projections",
    reads={**RUNS, "noise": TableOf("noise"), "noise_runs": Every(NOISE_RUNS)},
    scenes="bend_fall bend_poke bend_curved", methods=PAIR, groups="bending",
)  # fmt: skip
def bending_runs(drawn: Drawn, horizon: Horizon, noise: pd.DataFrame, **files: Files) -> Figure:
    """The projections of the preprint's two flat sheets are rounding errors, so a basis of them is
    noise. A reduced simulation then fails or not depending on which coordinates of its initial
    positions are perturbed. The projections of the curved sheet are not noise. Pictures show one
    frame: the full-order model, then simulations with reduced projections by basis size $r$. The
    text below a picture counts the perturbed starts that fail. The drawn start is the first for
    which some sizes fail and others do not (else the first of all).
    """
    noise_runs = files.pop("noise_runs")
    runs, rows = Runs(drawn, horizon, RANKS, (0.6,), **files), []
    for each in drawn.experiments:
        found, path = runs.rows(each), each.find(noise_runs)
        if found[0].note and path:
            own = noise[(noise.scene == each.scene) & (noise.group == each.group)]
            found = noise_rows(drawn, runs.shown(each), own, path) or found
        rows += found
    return view.draw_rows(rows)


def noise_rows(drawn: Drawn, shown: Shown, table: pd.DataFrame, path: str) -> list[Row]:
    """Return a row of pictures for each method and kind of perturbed start (keys of `NOISY`).

    The text below a picture counts the starts of this kind whose runs failed. Kinds with the same
    counts at every basis size share a row, with pictures of the first of these kinds.
    """
    shown, rows = replace(shown, bodies=None), []
    table = table[table.r <= table["rank"]]
    table = table.assign(failed=~(table.relative_error <= WRONG))
    for method in drawn.methods:
        alike: dict[tuple[tuple[int, str], ...], list[str]] = {}  # text for each size -> kinds
        for kind, own in table[table.method == method].groupby("noisy_axes", sort=False):
            sizes = own.groupby("r").failed
            counts = ((int(r), f"{one.sum()} of {len(one)} starts fail") for r, one in sizes)
            alike.setdefault(tuple(counts), []).append(str(kind))
        for texts, kinds in alike.items():
            remarks = dict(texts)
            panels = [
                replace(info.panel(shown.frame, shown.colour), remark=remarks[info.r])
                for info in rerun_infos(path, f"{kinds[0]}/{method}")
                if info.r in remarks
            ]
            start = ", ".join(NOISY[k] for k in kinds) if len(kinds) < len(NOISY) else "any"
            label = f"{drawn.title(method)}\nnoise: {start}\n{shown.when}"
            rows.append(shown.row(label, panels, panels))
    return rows


@figure(
    number=4, title="Three constraint groups, one of them reduced", reads=RUNS, scenes="cloth_all",
    methods=PAIR, several=True,
)  # fmt: skip
def cloth_all_grid(drawn: Drawn, horizon: Horizon, **files: Files) -> Figure:
    """Reducing the strain changes this simulation little, since springs carry nearly all of the
    force. Pictures show a cloth with bending, springs and strain in frames up to its predictability
    horizon: the full-order model, then simulations in which two methods reduce the projections of
    one constraint group. Colours show the distance to the full-order model, whose outline is grey.
    Red frame: picture at the smaller scale given below it.
    """
    # instants as fractions of the horizon
    runs = Runs(drawn, horizon, (20, 10, "full"), (0.5, 0.75, 1.0), **files)
    one = drawn.experiments[0]
    mesh, camera = load_mesh(one.find(runs.meshes)), camera_of(one)
    frames, full = positions_at(one.find(runs.full_order), runs.frames, runs.ends[one.scene])
    first = [
        RunPanel(f"frame {f}", style.FULL_ORDER, q, reference=True)
        for f, q in zip(frames, full, strict=True)
    ]
    windows = [view.shared_window(camera, q, [], margin=0.04) for q in full]
    size = (max(w.width for w in windows), max(w.height for w in windows))
    windows = [view.fit_aspect(w.resized(*size)) for w in windows] * len(drawn.methods)
    ghosts = np.concatenate([full] * len(drawn.methods))

    def row(label: str, panels: list[RunPanel], note: str | None) -> Row:
        return Row(label, mesh, panels, windows, ghosts, camera, note)

    rows = [row("full-order model", first * len(drawn.methods), None)]
    for each in drawn.of(one.scene):
        reduced = [
            _over_time(each.find(runs.reruns, method=m), runs, drawn.title(m), frames, full, mesh)
            for m in drawn.methods
        ]
        blank = [RunPanel("", style.GREY, None, remark="not run")] * len(frames)
        panels = [panel for run in reduced for panel in run or blank]
        note = None if any(reduced) else NOTHING_RAN
        rows.append(row(f"{style.words(each.group)} reduced", panels, note))
    made = view.draw_rows(rows, footer=FOOTER)
    inch = 1.0 / made.get_figheight()
    ax = made.add_axes((0.3, 0.40 * inch, 0.5, 0.08 * inch))
    bar = made.colorbar(_colours(), cax=ax, orientation="horizontal", extend="both")
    bar.set_label("distance to the full-order model / size of the mesh", labelpad=1)
    bar.outline.set_linewidth(0.4)
    return made


def _over_time(
    path: str, runs: Runs, title: str, frames: list[int], full: np.ndarray, mesh: Mesh
) -> list[RunPanel] | None:
    """Return panels of a reduced run at ``frames``, coloured by distance to the full-order run.

    ``full`` : (F, N, 3) m, full-order positions. Returns None if all sizes r exceed the rank.
    """
    infos = choose_ranks(rerun_infos(path), runs.ranks)
    info = next((i for i in infos if not i.marked), None)
    if info is None:
        return None
    plain, panels = style.surface_colour(style.GREY), []
    for frame, q in zip(frames, full, strict=True):
        middle = frame == frames[len(frames) // 2]
        titled = f"{title}, {info.title}" if middle else ""
        panel = replace(info.panel(frame, plain), title=titled)
        if panel.positions is not None and not panel.failure:
            distance = np.linalg.norm(panel.positions - q, axis=1) / mesh.extent
            colour = _colours().to_rgba(distance[mesh.triangles].mean(axis=1))[:, :3]
            panel = replace(panel, colour=colour)
        panels.append(panel)
    return panels


def _colours() -> ScalarMappable:
    from matplotlib.colors import LogNorm

    return magnitudes(LogNorm(*DISTANCES, clip=True))


@figure(
    title="Three reduced models in two scenes",
    reads={
        "meshes": RUNS["meshes"], "full_order": EachOf(HELDOUT, "drawn.experiments"),
        "reruns": RUNS["reruns"], "subspaces": EachOf(SUBSPACES, "drawn_subspaces"),
        "table": TableOf("reduced_reruns"),
    }, scenes="bar_release spring_oop", methods="published gappy", timed=True,
)  # fmt: skip
def teaser(drawn: Drawn, table: pd.DataFrame, **files: Files) -> Figure:
    """On a test trajectory, which was not used for training, the preprint's method fails; two other
    reduced models stay close to the full-order model. Each row shows one frame of a scene. Below a
    picture: position error relative to the full-order model up to the predictability horizon (until
    then tiny perturbations have no effect), and time per frame. Column 2: projections interpolated
    with $r$ modes as in the preprint's code. Column 3: projections interpolated with $r$ modes from
    three elements per mode, by one system for all coordinates. Column 4: positions in a subspace of
    $k$ modes, with sampled elements (ECSW). Outlines: full-order model; distant parts are cut off.
    """
    rows = [_teaser_row(drawn, each, table, files) for each in drawn.experiments]
    return view.draw_rows(rows, row_limit=TEASER_ROW)


def _teaser_row(
    drawn: Drawn, experiment: Experiment, table: pd.DataFrame, files: dict[str, Files]
) -> Row:
    """Return a row with the full-order run and the reduced runs of ``experiment``."""
    (frame,), _ = positions_at(experiment.find(files["full_order"]), (INSTANT,))
    frame -= frame % TEST_FRAMES
    with open_hdf5(experiment.find(files["full_order"])) as file:
        full = file["positions"][frame : frame + 1]
    looks = METHODS | drawn.looks
    colours = {name: style.surface_colour(colour) for name, (colour, _) in looks.items()}
    table = table[(table.scene == experiment.scene) & table.group.isin([experiment.group, "all"])]
    time = _milliseconds(table.ms_per_frame * table.speedup)
    panels = [RunPanel(words.method("fom"), style.FULL_ORDER, full[0], None, time, reference=True)]
    sizes = dict[str, int]()
    for method in drawn.methods:
        infos = rerun_infos(experiment.find(files["reruns"], method=method), FIRST)
        ran = [info for info in infos if not info.marked]
        for info in choose_ranks(ran, (MODES,))[-1:]:
            sizes["r"] = info.r
            rows = table[(table.method == method) & (table.r == info.r) & (table.group != "all")]
            shown = info.panel(frame, colours[method])
            panels.append(_with_numbers(shown, drawn.title(method), rows))
    path = experiment.find(files["subspaces"])
    for sizes["k"], positions in _subspace(frame, path) if path else ():
        rows = table[(table.method == TOLERANCE) & (table.k == sizes["k"])]
        shown = RunPanel("", colours["ecsw"], positions, remark="blew up")
        panels.append(_with_numbers(shown, words.method(TOLERANCE).partition(" (")[0], rows))
    camera, bodies = camera_of(experiment), obstacles_of(experiment, full)
    window = view.shared_window(camera, full[0], panels)
    panels = [replace(panel, obstacles=bodies, cropped=True) for panel in panels]
    size = ", ".join(f"{name} = {number}" for name, number in sizes.items())
    label = f"{experiment.title}\n{words.TRAJECTORIES[FIRST]}\nframe {frame}\n{size}"
    ghosts, windows = np.repeat(full, len(panels), axis=0), [window] * len(panels)
    return Row(label, load_mesh(experiment.find(files["meshes"])), panels, windows, ghosts, camera)


def _with_numbers(panel: RunPanel, title: str, rows: pd.DataFrame) -> RunPanel:
    """Return ``panel`` with ``title``, and the error and time of a model from ``rows`` below."""
    error = rows.relative_error_within_horizon[rows.motion == FIRST].dropna()
    look = {"precision": 2, "fractional": False, "trim": "-"}
    texts = [f"error {np.format_float_positional(100.0 * e, **look)} %" for e in error[:1]]
    texts = texts or [text for text in (panel.failure or panel.remark,) if text]
    texts += [text for text in [_milliseconds(rows.ms_per_frame)] if text]
    return replace(panel, title=title, failure=None, remark=", ".join(texts))


def _milliseconds(times: pd.Series) -> str | None:
    """Format the median of ``times`` in ms with its unit; None if all are missing."""
    return f"{times.median():.2g} ms" if times.notna().any() else None


def _subspace(frame: int, path: str) -> Iterator[tuple[int, np.ndarray | None]]:
    """Yield the number of modes of the largest position subspace up to `MODES`, and positions.

    The positions (N, 3) m are None if the run on the test trajectory diverged before ``frame``.
    Yields nothing without a subspace.
    """
    with open_hdf5(path) as file:
        models = file["models"]
        found = [k for k in range(MODES, 0, -1) if f"pod_k{k:03d}_{TOLERANCE}" in models]
        for k in found[:1]:
            stored = models[f"pod_k{k:03d}_{TOLERANCE}"][FIRST]["coordinates"]
            base = file["columns"][f"pod_k{k:03d}"]["B"]
            yield k, base[...] @ stored[frame] if len(stored) > frame else None
