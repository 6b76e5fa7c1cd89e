"""Pictures of a scene's runs one after the other: the full order beside the reduced runs."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pdrom.core.paths import MESH
from pdrom.model.mesh.types import Mesh, load_mesh
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera, Window, window_of
from pdrom.report.figures.kit.panels import RunPanel, draw_run, fit_aspect
from pdrom.report.scenes.loaded import LoadedRun, full_order, reduced
from pdrom.report.scenes.results import SceneResults

CAMERA = Camera(30.0, 20.0)
RATE = 30.0  # pictures a second at most
LONGEST = 300  # pictures
COLUMNS, WIDTH = 4, 2.4  # panels side by side, inches of each


@dataclass(frozen=True)
class Film:
    """Runs to be shown with their titles and mesh; ``time_step`` of a frame in s."""

    title: str
    mesh: Mesh
    time_step: float
    full: np.ndarray
    runs: list[tuple[str, LoadedRun]]
    colours: dict[str, tuple[float, float, float]]

    @property
    def stride(self) -> int:
        """Frames from one picture to the next."""
        frames = len(self.full) - 1
        return max(1, round(1.0 / (RATE * self.time_step)), ceil(frames / LONGEST))

    @property
    def rate(self) -> float:
        """Pictures a second: real time, as far as `RATE` allows."""
        return float(np.clip(1.0 / (self.stride * self.time_step), 1.0, RATE))

    def pictures(self, dpi: int) -> Iterator[np.ndarray]:
        """RGB pictures (height, width, 3) uint8 with even sides."""
        columns = min(COLUMNS, 1 + len(self.runs))
        rows = ceil((1 + len(self.runs)) / columns)
        window = fit_aspect(window_of(CAMERA, list(self.full[:: self.stride])))
        height = WIDTH * window.height / window.width + 0.45
        with style.look():
            figure = Figure(figsize=(columns * WIDTH, rows * height + 0.3), dpi=dpi)
            canvas = FigureCanvasAgg(figure)
            axes = figure.subplots(rows, columns, squeeze=False).ravel()
            figure.subplots_adjust(0.01, 0.03, 0.99, 0.86 if rows == 1 else 0.93, 0.03, 0.3)
            for ax in axes:
                ax.set_axis_off()
            heading = figure.suptitle("", fontsize=9)
            for frame in range(0, len(self.full), self.stride):
                heading.set_text(f"{self.title}, {frame * self.time_step:.2f} s")
                self._draw(list(axes), frame, window)
                canvas.draw()
                picture = np.asarray(canvas.buffer_rgba())[..., :3]
                high, wide = (2 * (side // 2) for side in picture.shape[:2])
                yield np.ascontiguousarray(picture[:high, :wide])

    def _draw(self, axes: list[Axes], frame: int, window: Window) -> None:
        ghost = self.full[frame]
        panels = [RunPanel("full order", style.FULL_ORDER, ghost, reference=True)]
        panels += [self._panel(name, run, frame) for name, run in self.runs]
        for ax, panel in zip(axes, panels, strict=False):
            ax.clear()
            outline = None if panel.reference else ghost
            draw_run(ax, self.mesh, panel.seen_by(CAMERA), CAMERA, window, outline)

    def _panel(self, name: str, run: LoadedRun, frame: int) -> RunPanel:
        colour, last = self.colours[run.group], len(run.positions) - 1
        blew_up = 0 <= run.info.blowup_frame < frame
        failure = f"blew up at frame {run.info.blowup_frame}" if blew_up or frame > last else None
        at = min(frame, last)
        return RunPanel(name, colour, run.positions[at].astype(float), failure)


def film_of(results: SceneResults) -> Film:
    """The film of a scene; StorageError for a file that is missing or damaged."""
    looks = style.group_looks(results.holdings)
    return Film(
        style.words(results.scene),
        load_mesh(results.path(MESH, results.scene)),
        results.settings["time_step"],
        full_order(results),
        [(_title(results, run), run) for run in reduced(results)],
        {group: style.surface_colour(look[0]) for group, look in looks.items()},
    )


def _title(results: SceneResults, run: LoadedRun) -> str:
    """Method and size, below the group where the scene reduces several."""
    group = f"{style.words(run.group)}\n" if len(results.groups) > 1 else ""
    return f"{group}{results.method_title(run.method)}, r = {run.info.r}"
