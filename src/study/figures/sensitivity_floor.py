"""Figure of the difference of full-order runs from slightly different starts, by frame."""

import numpy as np

from pdrom.core.store import read_table
from pdrom.view import style
from pdrom.view.artists import Figure
from study.artifact import words
from study.artifact.paths import SENSITIVITY, File
from study.artifact.reads import EachOf, Read, Setting
from study.experiments.kit.base import Horizon, floor_of
from study.experiments.kit.base import horizon as horizon_of
from study.figures.kit.declaration import Drawn, NothingToDraw, figure
from study.figures.kit.labels import Curve, label_curves

# Inputs of `floors_of`.
FLOORS: dict[str, Read] = {
    "sensitivity": EachOf(SENSITIVITY, "drawn.experiments"),
    "horizon": Setting("horizon"),
}
COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


def floors_of(
    sensitivity: list[File], horizon: Horizon
) -> dict[str, tuple[np.ndarray, int | None]]:
    """Map each scene to its sensitivity (F,) and its horizon (None: beyond the last frame).

    The sensitivity is the relative difference between full-order runs with perturbed and
    unperturbed starts in each of F frames, the largest over all random seeds; it is empty without
    perturbed runs. The horizon is the first frame in which it exceeds a threshold; later
    frames of runs cannot be compared. Raises StorageError for a damaged file.
    """
    found = {}
    for file in sensitivity:
        floor = floor_of(read_table(file.path, COLUMNS), file["scene"], horizon.perturbation)
        end = horizon_of(floor, horizon.threshold)
        found[file["scene"]] = floor, end if end < len(floor) else None
    return found


LOW, HIGH = 1e-12, 1e2
MOST = 6  # largest number of curves
HEIGHT = 2.15  # height of the figure, inches


@figure(
    title="Sensitivity and predictability horizon", reads=FLOORS,
    scenes="cloth_all cloth_all_twin strain_twist bar_release",
)  # fmt: skip
def sensitivity_floor(drawn: Drawn, sensitivity: list[File], horizon: Horizon) -> Figure:
    """In some scenes a tiny change of the initial positions grows until two full-order simulations
    disagree. Lines: relative difference of two simulations whose initial positions differ by
    {sensitivity.reference} of the body size. The horizon of a scene (dot) is the first frame at
    which the difference exceeds {sensitivity.threshold} (grey line). No reduced simulation
    is evaluated beyond the horizon (dotted). Scenes without a dot are predictable to their end.
    """
    floors = floors_of(sensitivity, horizon)
    scenes = [scene for scene in drawn.scenes if len(floors[scene][0])][:MOST]
    if not scenes:
        raise NothingToDraw
    figure, labelled = style.new_figure(HEIGHT), list[Curve]()
    ax = figure.subplots()
    style.log_axis(ax, LOW, HIGH)
    ax.set_xlim(0, max(len(floors[scene][0]) for scene in scenes))
    ax.axhline(horizon.threshold, color=style.GREY, linewidth=0.9)
    for scene, colour in zip(scenes, style.CYCLE, strict=False):
        floor, end = floors[scene]
        points = np.stack([np.arange(len(floor)), np.clip(floor, LOW, HIGH)], axis=1)
        last = len(floor) if end is None else end + 1
        ax.plot(*points[:last].T, color=colour, linewidth=1.4)
        ax.plot(*points[last - 1 :].T, ":", color=colour, linewidth=1.0)
        if end is not None:
            ax.plot(*points[end], "o", color=colour, markersize=5.0, zorder=5)
        found, few = "predictable" if end is None else f"horizon {end}", len(points) // 40 + 1
        labelled.append((f"{words.scene(scene)}: {found}", colour, points[::few]))
    ax.set(xlabel="frame (dotted: beyond the horizon, not evaluated)", ylabel="relative difference")
    label_curves(ax, labelled, (0.88 * style.WIDTH, HEIGHT - 0.5))
    return figure
