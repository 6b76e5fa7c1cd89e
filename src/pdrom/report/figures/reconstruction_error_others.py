"""Reconstruction error against the basis size, on the scenes that the paper leaves out."""

from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.options import Reconstruction
from pdrom.report.figures.kit.reconstruction import READS, draw_reconstruction
from pdrom.report.figures.kit.results import Results


@figure(
    title="Reconstruction error of further scenes",
    caption=(
        "As the figure of the paper, for the other scenes of the preprint and, last, for sheets "
        "whose motion is not decided by round-off."
    ),
    reads=READS,
    options=Reconstruction,
)
def reconstruction_error_others(results: Results, options: Reconstruction) -> Figure:
    """Draw errors of reconstructed snapshots, see `draw_reconstruction`."""
    return draw_reconstruction(results, options)
