"""Films of a scene, MP4 (H.264) and GIF: the full order beside the reduced runs."""

from collections.abc import Iterator
from math import ceil
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from pdrom.core.store import atomic_path
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera, window_of
from pdrom.report.figures.kit.panels import RunPanel, draw_run, fit_aspect
from pdrom.report.scenes.picture import panel_of, shown_runs, title_of
from pdrom.report.viewer.runs import ViewedScene

CAMERA = Camera(30.0, 20.0)
RATE = 30.0  # pictures a second at most
LONGEST = 300  # pictures
COLUMNS, WIDTH = 4, 2.4  # panels side by side, inches of each
MP4_DPI, GIF_DPI, COLOURS = 150, 75, 96
# one thread and no date: the same bytes every time
SAME = ["-threads", "1", "-x264-params", "threads=1", "-fflags", "+bitexact", "-flags", "+bitexact"]


def animation(scene: ViewedScene, film: Path) -> None:
    """Write a ``film`` of ``scene`` that common browsers and players show.

    It is made by the ffmpeg that a package brings.
    """
    shots = pictures(scene, MP4_DPI)
    first = next(shots)
    with atomic_path(film, with_checksum=False) as path:
        writer = imageio_ffmpeg.write_frames(
            str(path), first.shape[1::-1], fps=_rate(scene), macro_block_size=2, output_params=SAME
        )
        writer.send(None)
        try:
            writer.send(first)
            for picture in shots:
                writer.send(picture)
        finally:
            writer.close()


def gif(scene: ViewedScene, film: Path) -> None:
    """Write the ``film`` of ``scene``, without end; all pictures have the last one's colours."""
    shots = [Image.fromarray(picture) for picture in pictures(scene, GIF_DPI)]
    palette = shots[-1].quantize(COLOURS)
    first, *others = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in shots]
    with atomic_path(film, with_checksum=False) as path:
        first.save(
            path,
            save_all=True,
            append_images=others,
            duration=durations(len(shots), _rate(scene)),
            loop=0,
        )


def durations(count: int, rate: float) -> list[int]:
    """Milliseconds of each picture: whole hundredths of a second, which together keep the rate.

    Parameters
    ----------
    rate : pictures a second
    """
    ends = np.round(100.0 / rate * np.arange(count + 1))
    return (10 * np.diff(ends)).astype(int).tolist()


def pictures(scene: ViewedScene, dpi: int) -> Iterator[np.ndarray]:
    """RGB pictures (height, width, 3) uint8 of ``scene``, with even sides, one every few frames.

    ``dpi`` is their resolution, dots an inch.
    """
    runs, stride = shown_runs(scene), _stride(scene)
    columns = min(COLUMNS, 1 + len(runs))
    rows = ceil((1 + len(runs)) / columns)
    window = fit_aspect(window_of(CAMERA, list(scene.positions[::stride])))
    height = WIDTH * window.height / window.width + 0.6
    with style.look():
        figure = Figure(figsize=(columns * WIDTH, rows * height + 0.3), dpi=dpi)
        canvas = FigureCanvasAgg(figure)
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        figure.subplots_adjust(0.01, 0.03, 0.99, 0.83 if rows == 1 else 0.92, 0.03, 0.3)
        for ax in axes:
            ax.set_axis_off()
        heading = figure.suptitle("", fontsize=9)
        for frame in range(0, len(scene.positions), stride):
            heading.set_text(f"{style.words(scene.name)}, {frame * scene.time_step:.2f} s")
            full = scene.positions[frame]
            panels = [RunPanel("full order", style.FULL_ORDER, full, reference=True)]
            panels += [panel_of(run, frame, title_of(scene, run)) for run in runs]
            for ax, panel in zip(axes, panels, strict=False):
                ax.clear()
                outline = None if panel.reference else full
                draw_run(
                    ax,
                    scene.mesh,
                    panel.seen_by(CAMERA),
                    camera=CAMERA,
                    window=window,
                    ghost=outline,
                )
            canvas.draw()
            picture = np.asarray(canvas.buffer_rgba())[..., :3]
            high, wide = (2 * (side // 2) for side in picture.shape[:2])
            yield np.ascontiguousarray(picture[:high, :wide])


def _stride(scene: ViewedScene) -> int:
    """Frames from one picture to the next."""
    frames = len(scene.positions) - 1
    return max(1, round(1.0 / (RATE * scene.time_step)), ceil(frames / LONGEST))


def _rate(scene: ViewedScene) -> float:
    """Pictures a second: real time, as far as `RATE` allows."""
    return float(np.clip(1.0 / (_stride(scene) * scene.time_step), 1.0, RATE))
