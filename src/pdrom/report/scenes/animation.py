"""Animation of a scene as MP4 (H.264), by the ffmpeg that a package brings."""

from collections.abc import Mapping
from pathlib import Path

import imageio_ffmpeg

from pdrom.core.store import atomic_path
from pdrom.report.scenes.film import Film, film_of
from pdrom.report.scenes.results import SceneResults

DPI = 150
# one thread and no date: the same bytes every time
SAME = ["-threads", "1", "-x264-params", "threads=1", "-fflags", "+bitexact", "-flags", "+bitexact"]


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the film."""
    with atomic_path(outputs["film"]) as path:
        write_mp4(film_of(results), path)


def write_mp4(film: Film, path: Path) -> None:
    """Write a film that common browsers and players show."""
    pictures = film.pictures(DPI)
    first = next(pictures)
    writer = imageio_ffmpeg.write_frames(
        str(path), first.shape[1::-1], fps=film.rate, macro_block_size=2, output_params=SAME
    )
    writer.send(None)
    try:
        writer.send(first)
        for picture in pictures:
            writer.send(picture)
    finally:
        writer.close()
