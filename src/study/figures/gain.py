"""Figures of errors by DEIM constant, method and basis size, and of singular values.

Columns `gain` have the DEIM constant: the norm that bounds how much interpolation amplifies errors.
"""

from itertools import cycle
from pathlib import Path
from textwrap import fill

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Axes, Figure
from study.artifact import words
from study.artifact.reads import ProjectFile, TableOf
from study.figures.kit.declaration import GROUPS, MESHES, Drawn, Experiment, figure, held
from study.figures.kit.multiples import label_outer, label_rows, small_multiples
from study.tables.kit.results import FAILED, judged_runs

GAINS = (1.0, 1e5)  # limits of the axis of DEIM constants; points outside are on the limits
ERRORS, LADDER_ERRORS = (1e-5, 1e2), (1e-3, 30.0)
ENDS, TITLE = ("low", "median", "high"), 24  # longest line of the title of a panel, characters
DECADES = 4  # one bar per decade of the constant from 1 on, and a last bar for all larger constants
_KEYS = ["scene", "group", "method", "r"]


@figure(
    title="Errors against the DEIM constant",
    reads={
        "reruns": TableOf("reduced_reruns"), "errors": TableOf("reconstruction_error"),
        "repetitions": TableOf("repetitions"),
    },
)  # fmt: skip
def error_against_gain(drawn: Drawn, **tables: pd.DataFrame) -> Figure:
    """Most simulations with a large DEIM constant fail, and few with a small constant do. The DEIM
    constant bounds how much interpolation amplifies errors. Left: position error up to the
    predictability horizon, relative to the full-order simulation; one mark per simulation whose
    basis suffices (with the orthogonal projection onto it, the simulation does not fail). Above the
    dashed line (10 %) simulations fail; arrows point to values outside the axes. Crosses: median
    and range over random training frames. Right: share of simulations that fail.
    """
    runs = drawn.rows(judged_runs(tables["reruns"], tables["errors"]))
    figure = style.new_figure(3.0)
    left, right = figure.subplots(1, 2, width_ratios=(2.2, 1.0))
    names = [*_KEYS, *(f"{q}_{e}" for q in ("gain", "error") for e in ENDS)]
    ranges = runs[:0].reindex(columns=names)
    if len(repeated := tables["repetitions"]):
        repeated = repeated[repeated.varied == "training"]
        ranges = runs[[*_KEYS, "gain", "error"]].merge(repeated, on=_KEYS)
    styles = drawn.styles(runs)
    for method, look in styles.items():
        own = runs[runs.method == method]
        _draw_method(left, own, ranges[ranges.method == method], *look)
    style.log_axis(left, *ERRORS)
    left.set(xscale="log", xlim=GAINS, xlabel="DEIM constant")
    left.set_ylabel("position error before the horizon")
    left.axhline(FAILED, color="#333333", linewidth=0.8, linestyle="--", zorder=0)
    left.text(GAINS[1], FAILED * 1.1, "failed ", ha="right", va="bottom", fontsize=7.5)
    left.text(GAINS[0] * 1.1, ERRORS[1] * 0.8, "blown up: upper limit", va="top", fontsize=7.5)
    _draw_decades(right, runs)
    style.legend(figure, drawn.handles(styles, linestyle="none"), 4)
    return figure


def _draw_method(
    ax: Axes, runs: pd.DataFrame, ranges: pd.DataFrame, colour: str, marker: str
) -> None:
    """Draw a mark (DEIM constant, error) per run, and crosses for ``ranges`` over repetitions."""
    x, y = runs.gain.to_numpy(float), runs.error.to_numpy(float)
    outside = {4: x < GAINS[0], 5: x > GAINS[1], 6: y > ERRORS[1], 7: y < ERRORS[0]}
    x, y = np.clip(x, *GAINS), np.clip(y, *ERRORS)
    look = {"linestyle": "none", "color": colour, "markeredgewidth": 0.0, "clip_on": False}
    for arrow, beyond in outside.items():  # by Matplotlib's numbers of arrow markers
        if beyond.any():  # an artist without points and clipping would move the axes
            ax.plot(x[beyond], y[beyond], marker=arrow, markersize=5.0, alpha=0.8, **look)
    ax.plot(x, y, marker=marker, markersize=3.2, alpha=0.7, **look)
    gains = [np.clip(ranges[f"gain_{e}"].to_numpy(float), *GAINS) for e in ENDS]
    errors = [np.clip(ranges[f"error_{e}"].to_numpy(float), *ERRORS) for e in ENDS]
    bars = {"color": colour, "linewidth": 0.9, "zorder": 3}
    ax.vlines(gains[1], errors[0], errors[2], **bars)
    ax.hlines(errors[1], gains[0], gains[2], **bars)


def _draw_decades(ax: Axes, runs: pd.DataFrame) -> None:
    """Draw a bar for each decade of the constant: per cent of failed runs, number of runs."""
    # the last bar counts all larger constants, including infinite ones
    upper = np.ceil(np.log10(runs.gain.clip(upper=10.0**DECADES + 1.0))).clip(lower=1)
    decades = runs.groupby(upper.astype(int)).failed.agg(["size", "mean"])
    places = np.arange(len(decades))
    ax.bar(places, 100.0 * decades["mean"], width=0.7, color=style.FAILED, alpha=0.75)
    for place, count, share in zip(places, decades["size"], decades["mean"], strict=True):
        ax.text(place, 100.0 * share + 1.5, f"{count}", ha="center", fontsize=7.5)
    spans = {upper: rf"$10^{{{upper - 1}}}$ to $10^{{{upper}}}$" for upper in decades.index}
    spans |= {upper: rf"over $10^{{{DECADES}}}$" for upper in spans if upper > DECADES}
    ax.set_xticks(places, list(spans.values()))
    ax.set(ylim=(0, 112), yticks=[0, 25, 50, 75, 100])
    ax.tick_params(axis="x", labelrotation=35)
    ax.set(xlabel="DEIM constant", ylabel="failed simulations (%)", title="above bars: simulations")
    ax.grid(True)


# Ablation step in the table `ladder` -> row label; each step keeps all earlier changes.
STEPS = {
    "published code": "preprint's code",
    "+ affine centring": "snapshots minus their mean",
    "+ shared coefficients": "one system for all coordinates",
    "+ whole elements": "element-wise sampling",
    "+ three elements a mode (sound)": "three elements per mode",
    "and a gain of at most 2": "more elements: constant at most 2",
}
THICK = 2  # number of scenes with thick lines and printed DEIM constants


@figure(
    title="Ablation: one change after another", reads={"table": TableOf("ladder")},
    scenes="bar_release spring_oop bar_twist strain_oop spring_twist_twin strain_twist_twin "
    f"bend_curved {MESHES}",
)  # fmt: skip
def ladder(drawn: Drawn, table: pd.DataFrame) -> Figure:
    """In most scenes, one system for all coordinates or three elements per mode reduces the error
    most. Each line is a scene: position errors of reduced simulations of the training trajectory,
    relative to the full-order simulation, up to the predictability horizon. The first row is the
    preprint's code; each further row makes one change and keeps all earlier changes. Thin
    horizontal lines: ranges over simulations with randomly drawn training frames. Numbers on the
    right: DEIM constants of the scenes with thick lines. Scenes marked (short) have fewer frames.
    """
    table = held(table[table.scene.isin(drawn.scenes) & table.gain.notna()])
    table = held(table[table.direction.isin(["up", "down"])])
    known = [step for step in STEPS if step in {*table.rung}]
    steps = known or list(dict.fromkeys(table.rung[table.direction == "up"]))
    scenes = [scene for scene in drawn.scenes if scene in {*table.scene}]
    figure = style.new_figure(0.19 * len(steps) + 1.2)
    ax = figure.subplots()
    ax.set(xscale="log", xlim=(LADDER_ERRORS[0], LADDER_ERRORS[1] * 1.1), xlabel="position error")
    ax.grid(True, axis="x")
    looks = dict(zip(scenes, zip(cycle(style.CYCLE), cycle("os^DvPX"), strict=False), strict=False))
    for place, (scene, (colour, marker)) in reversed([*enumerate(looks.items())]):
        rows = table[table.scene == scene].drop_duplicates("rung").set_index("rung").reindex(steps)
        thick = place < THICK
        heights = np.arange(len(steps)) + 0.06 * (place - 0.5 * (len(scenes) - 1))
        look = {"color": colour, "marker": marker, "markersize": 5.0 if thick else 3.0}
        errors = rows.relative_error_within_horizon.fillna(np.inf).clip(*LADDER_ERRORS)
        ax.plot(errors, heights, linewidth=2.0 if thick else 0.7, **look)
        ends = (rows[end].clip(*LADDER_ERRORS) for end in ("error_low", "error_high"))
        ax.hlines(heights, *ends, color=colour, linewidth=0.9)
        if thick:
            column = {"transform": ax.get_yaxis_transform(), "color": colour, "ha": "right"}
            for y, constant in enumerate(rows.gain):
                number = f"{constant:,.0f}" if constant >= 10.0 else f"{constant:.1f}"
                ax.text(1.09 + 0.1 * place, y, number, va="center", **column)
    ax.text(1.2, -0.75, "DEIM constants", ha="right", transform=ax.get_yaxis_transform())
    label_rows(ax, [STEPS.get(step, style.plain_words(step)) for step in steps])
    named = {words.scene(scene): look for scene, look in looks.items()}
    style.legend(figure, style.handles(named), 3)
    return figure


VALUES = (1e-17, 3.0)
SHOWN = (1e-7, 1e3)  # limits of the error axis; errors outside are drawn on the limits
# Set of snapshots -> legend entry and line style.
SPLITS = {"train": ("training", "-"), "test": ("frames between", "--"), "heldout": ("test 1", ":")}
PUBLISHED = "#B5B5B5"
PUBLISHED_CODE = "config/reference/published_code"
# Scene -> most similar experiment of the published code, whose output is drawn in its panel.
BESIDE = {"cloth_all": "all_three", "bend_fall": "bending_only", "bar_release": "bar"}
REGION = "#F1EFEB"
HOLLOW = {"markerfacecolor": "white", "markeredgecolor": "#777777"}
Panel = tuple[Axes, Experiment, pd.DataFrame]


def _panels(
    drawn: Drawn, table: pd.DataFrame, limits: tuple[float, float], columns: int, legend: int
) -> tuple[Figure, list[Panel]]:
    """Return a figure, ``legend`` lines below, and a panel per scene and group in ``table``."""
    rows = dict([*held(table[table.scene.isin(drawn.scenes)]).groupby(["scene", "group"])])
    shown = [each for each in drawn.experiments if (each.scene, each.group) in rows]
    figure, axes = small_multiples(len(shown), columns, legend_rows=legend)
    for ax, each in zip(axes, shown, strict=True):
        style.log_axis(ax, *limits)
        ax.set_title(fill(each.title, TITLE))
    found = [rows[each.scene, each.group] for each in shown]
    return figure, list(zip(axes, shown, found, strict=True))


def _published(path: Path, columns: list[str], each: Experiment) -> pd.DataFrame:
    """Read the output of the preprint's code in ``path`` for the experiment most like ``each``."""
    output = read_table(path, ["experiment", "group", *columns], result=False)
    name = BESIDE.get(each.scene)
    return output[(output.experiment == name) & (output.group == each.group)]


@figure(
    number=9, title="Decay of the singular values",
    reads={
        "table": TableOf("singular_values"),
        "published": ProjectFile(f"{PUBLISHED_CODE}/singular_values.csv"),
    },
    scenes="cloth_all bend_fall bend_poke bend_curved spring_stretch spring_twist spring_oop "
    f"strain_stretch strain_twist strain_poke strain_oop bar_release bar_twist {MESHES}",
)  # fmt: skip
def singular_values(drawn: Drawn, table: pd.DataFrame, published: Path) -> Figure:
    """The singular values of the training snapshots decay, except where the projections consist of
    rounding errors. Values are divided by the first; hollow marks lie below the rounding errors of
    the projections and are noise. Grey: output of the preprint's code for its most similar scene.
    """
    figure, panels = _panels(drawn, table, VALUES, 4, legend=2)
    reference = False
    for ax, each, rows in panels:
        output = _published(published, ["component", "singular_value"], each)
        values = output.sort_values("component").singular_value.to_numpy(float)
        if len(values) and values[0] > 0.0:
            reference = True
            shown = np.clip(values / values[0], VALUES[0], None)
            ax.plot(np.arange(1, len(values) + 1), shown, color=PUBLISHED, linewidth=0.9, zorder=1)
        _draw_values(ax, rows.sort_values("component"), *GROUPS[each.group])
    label_outer([ax for ax, *_ in panels], 4, "component", "singular value / first")
    handles = style.handles({style.words(e.group): GROUPS[e.group] for _, e, _ in panels})
    handles.append(style.handle("below rounding errors", linestyle="none", marker="o", **HOLLOW))
    if reference:
        handles.append(style.handle("preprint's output", color=PUBLISHED))
    style.legend(figure, handles, 4)
    return figure


def _draw_values(ax: Axes, rows: pd.DataFrame, colour: str, marker: str) -> None:
    """Draw singular values; those below rounding errors are hollow, in a shaded region."""
    component = rows.component.to_numpy(float)
    above = rows.above_roundoff.astype(bool).to_numpy()
    # zeros cannot be drawn on a logarithmic axis and are raised to its lower limit
    shown = np.clip(np.nan_to_num(rows.relative.to_numpy(float)), VALUES[0], None)
    if not above.all():
        limit = np.sqrt(shown[~above].max() * shown[above].min()) if above.any() else VALUES[1]
        ax.axhspan(VALUES[0], limit, color=REGION, linewidth=0.0, zorder=0)
        look = {"fontsize": 7.5, "color": "#6B675F", "style": "italic", "zorder": 2}
        text = "rounding errors" if above.any() else "rounding errors only"
        box = {"fc": REGION, "ec": "none", "pad": 0}
        ax.text(0.03, 0.04, text, transform=ax.transAxes, bbox=box, **look)
    ax.plot(component[above], shown[above], color=colour, linewidth=0.8)
    for mask, marks in ((above, {"color": colour}), (~above, HOLLOW | {"markeredgewidth": 0.5})):
        dots = marks | {"linestyle": "none", "markersize": 2.8, "clip_on": False}
        if mask.any():
            ax.plot(component[mask], shown[mask], marker=marker, **dots)
    ax.set_xlim(0, 1.02 * max(component.max(), 1.0))


@figure(
    number=8, title="Reconstruction error",
    reads={
        "table": TableOf("reconstruction_error"),
        "published": ProjectFile(f"{PUBLISHED_CODE}/reconstruction_error.csv"),
    }, scenes=f"spring_twist strain_stretch bar_release {MESHES}",
    methods="pod deim deim-joint published block-deim",
)  # fmt: skip
def reconstruction_error(drawn: Drawn, table: pd.DataFrame, published: Path) -> Figure:
    """On training frames, methods with one system for all coordinates (entry-wise and element-wise
    DEIM) are nearly as accurate as the orthogonal projection. The preprint's selection and code are
    less accurate. Lines: relative error if the projections of all elements are reconstructed from
    samples with $r$ basis vectors. Solid: training frames; dashed: frames between them; dotted:
    first test trajectory. Light grey lines without marks: errors that the preprint's code printed
    for a similar scene. Arrow heads at the upper edge: larger errors.
    """
    styles = drawn.styles(table)
    figure, panels = _panels(drawn, table, SHOWN, 3, legend=3)
    reference = False
    for ax, each, rows in panels:
        columns = ["split", "num_points", "relative_error_x"]
        output = _published(published, columns, each)
        output = output[output.split == "train"].sort_values("num_points")
        for axis in ("x", "y") if len(output) else ():
            reference = True
            error = np.clip(output[f"relative_error_{axis}"].to_numpy(float), *SHOWN)
            ax.plot(output.num_points, error, color=PUBLISHED, linewidth=0.7, zorder=1)
        lines = [_draw_errors(ax, rows[rows.method == m], *styles[m]) for m in styles]
        if not any(lines):
            note = "projections are rounding errors:\nno relative error exists"
            look = {"ha": "center", "va": "center", "color": "#666666", "transform": ax.transAxes}
            ax.text(0.5, 0.5, note, bbox={"fc": "white", "ec": "none", "pad": 2}, **look)
        ax.set_xlim(0, max(float(rows.r.max()), 1.0) * 1.02)
    label_outer([ax for ax, *_ in panels], 3, "basis size r", "relative error")
    handles = drawn.handles(styles)
    handles += [style.handle(text, color="#555555", linestyle=s) for text, s in SPLITS.values()]
    if reference:
        label = "preprint's output (x, y)"
        handles.append(style.handle(label, color=PUBLISHED, linewidth=1.0))
    style.legend(figure, handles, 3)
    return figure


def _draw_errors(ax: Axes, rows: pd.DataFrame, colour: str, marker: str) -> bool:
    """Draw errors of a method, arrows for errors above the axis; return if any is finite."""
    drawn = False
    for split, (_, dashes) in SPLITS.items():
        line = rows[rows.split == split].sort_values("r")
        error = line.relative_error.to_numpy(float)
        if not np.isfinite(error).any():
            continue
        drawn, train = True, split == "train"
        shown = np.clip(np.where(np.isfinite(error), error, np.nan), *SHOWN)
        marks = {"marker": marker, "markersize": 2.8, "markevery": max(1, len(shown) // 5)}
        look = {"linewidth": 1.2, **marks} if train else {"linewidth": 0.9}
        ax.plot(line.r, shown, dashes, color=colour, clip_on=False, **look)
        above = error > SHOWN[1]
        if train and above.any():
            rim = np.full(above.sum(), SHOWN[1])
            arrow = {"marker": 6, "markersize": 5, "clip_on": False, "zorder": 5}
            ax.plot(line.r[above], rim, linestyle="none", color=colour, **arrow)
    return drawn
