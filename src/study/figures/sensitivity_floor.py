"""Figure of how far full-order runs from slightly different starts drift apart, by frame."""

import numpy as np

from pdrom.core.store import read_table
from pdrom.model.effects import EFFECTS
from pdrom.view import style
from pdrom.view.artists import Figure
from study.artifact.paths import SENSITIVITY, File
from study.artifact.reads import EachOf, Read, Setting
from study.experiments.kit.base import Horizon, floor_of
from study.experiments.kit.base import horizon as horizon_of
from study.figures.kit.declaration import MESHES, Drawn, NothingToDraw, figure
from study.figures.kit.multiples import label_outer, small_multiples
from study.tables.kit.results import TWIN

# Inputs of `floors_of`.
FLOORS: dict[str, Read] = {
    "sensitivity": EachOf(SENSITIVITY, "drawn.experiments"),
    "horizon": Setting("horizon"),
}
COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


def floors_of(
    sensitivity: list[File], horizon: Horizon
) -> dict[str, tuple[np.ndarray, int | None]]:
    """Map each scene to its sensitivity floor (F,) and its horizon; None: beyond the run.

    The floor is the relative difference between full-order runs with perturbed and unperturbed
    starts in each of F frames, the largest over all random seeds; it is empty without perturbed
    runs. The horizon is the first frame in which it exceeds a threshold; from there on runs cannot
    be compared. Raises StorageError for a damaged file.
    """
    found = {}
    for file in sensitivity:
        floor = floor_of(read_table(file.path, COLUMNS), file["scene"], horizon.perturbation)
        end = horizon_of(floor, horizon.threshold)
        found[file["scene"]] = floor, end if end < len(floor) else None
    return found


LOW, HIGH = 1e-12, 1e2


@figure(
    title="Sensitivity floor and horizon", reads=FLOORS,
    scenes="cloth_all cloth_all_twin cloth_all_oop strain_stretch strain_twist strain_stretch_twin "
    f"strain_twist_twin strain_oop bar_release bar_twist {MESHES}",
)  # fmt: skip
def sensitivity_floor(drawn: Drawn, sensitivity: list[File], horizon: Horizon) -> Figure:
    """Drift of full-order runs whose initial positions differ by {sensitivity.reference} of the
    extent. The horizon, given in the legends, is the first frame above the threshold of
    {sensitivity.threshold}: beyond it a reduced run cannot be judged by its error. Dashed lines are
    twins, scenes that end before.
    """
    floors = floors_of(sensitivity, horizon)
    kinds: dict[str, list[str]] = {}
    for scene in drawn.scenes:
        if len(floors[scene][0]):
            kinds.setdefault(_kind(drawn, scene), []).append(scene)
    if not kinds:
        raise NothingToDraw
    columns = min(3, len(kinds))
    figure, axes = small_multiples(len(kinds), columns, height=2.7)
    for ax, (kind, scenes) in zip(axes, kinds.items(), strict=True):
        style.log_axis(ax, LOW, HIGH)
        ax.axhline(horizon.threshold, color=style.GREY, linewidth=0.9)
        families = list(dict.fromkeys(scene.removesuffix(TWIN) for scene in scenes))
        for scene in scenes:
            family = families.index(scene.removesuffix(TWIN))
            colour = style.CYCLE[family % len(style.CYCLE)]
            floor, end = floors[scene]
            label = f"{style.words(scene)}: {f'beyond {len(floor)}' if end is None else end}"
            line = "--" if scene.endswith(TWIN) else "-"
            shown = np.clip(floor, LOW, HIGH)
            ax.plot(np.arange(len(shown)), shown, color=colour, label=label, linestyle=line)
            if end is not None:
                dot = {"marker": "o", "markersize": 4.5, "zorder": 5}
                ax.plot([end], [horizon.threshold], color=colour, **dot)
        ax.set(title=kind, xlabel="frame")
        look = {"fontsize": 7.5, "handlelength": 1.6, "labelspacing": 0.25}
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.31), **look)
    label_outer(axes, columns, "frame", y="relative difference")
    handles = [
        style.handle(f"threshold {horizon.threshold:g}", color=style.GREY),
        style.handle("horizon (frame given)", color="#555555", marker="o", linestyle="none"),
    ]
    style.legend(figure, handles, 2)
    return figure


def _kind(drawn: Drawn, scene: str) -> str:
    first, *others = drawn.of(scene)
    on_volume = not others and EFFECTS.load(first.group).cells == "tetrahedron"
    return "tetrahedra" if on_volume else drawn.groups_of(scene)
