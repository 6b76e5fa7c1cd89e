"""Animation of a scene as GIF, for pages that show no film."""

from collections.abc import Mapping

import numpy as np
from PIL import Image

from pdrom.core.store import atomic_path
from pdrom.report.scenes.film import film_of
from pdrom.report.scenes.results import SceneResults

DPI = 75
COLOURS = 96


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the film, without end; all pictures share the colours of the last one."""
    film = film_of(results)
    pictures = [Image.fromarray(picture) for picture in film.pictures(DPI)]
    palette = pictures[-1].quantize(COLOURS)
    flat = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    with atomic_path(outputs["film"]) as path:
        flat[0].save(
            path,
            save_all=True,
            append_images=flat[1:],
            duration=durations(len(flat), film.rate),
            loop=0,
        )


def durations(pictures: int, rate: float) -> list[int]:
    """Milliseconds of each picture: whole hundredths of a second, which together keep the rate."""
    ends = np.round(100.0 / rate * np.arange(pictures + 1))
    return (10 * np.diff(ends)).astype(int).tolist()
