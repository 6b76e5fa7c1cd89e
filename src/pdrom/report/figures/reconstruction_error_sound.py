"""Reconstruction error against the basis size, on well-posed scenes."""

from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.options import Reconstruction
from pdrom.report.figures.kit.reconstruction import READS, draw_reconstruction
from pdrom.report.figures.kit.results import Results


@figure(
    title="Reconstruction error of the well-posed scenes",
    caption=(
        "As the figure for the preprint's scenes, for scenes whose motion is not decided by "
        "round-off: horizontal sheets held on one side, and a sheet with a curved rest shape."
    ),
    reads=READS,
    options=Reconstruction,
)
def reconstruction_error_sound(results: Results, options: Reconstruction) -> Figure:
    """Draw errors of reconstructed snapshots, see `draw_reconstruction`."""
    return draw_reconstruction(results, options)
