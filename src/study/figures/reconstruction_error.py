"""Reconstruction error of snapshots against the basis size, on the preprint's scenes."""

from pdrom.view.artists import Figure
from study.figures.kit.declaration import figure
from study.figures.kit.options import Reconstruction
from study.figures.kit.reconstruction import READS, draw_reconstruction
from study.figures.kit.results import Results


@figure(
    number=8,
    title="Reconstruction error of three scenes of the preprint",
    caption=(
        "Relative error of reconstructed projections against the number $r$ of basis vectors, for "
        "the snapshots used (train), the frames between them (test) and another run (held out). "
        "Errors above the axis are drawn on its rim with an arrow head."
    ),
    reads=READS,
    options=Reconstruction,
)
def reconstruction_error(results: Results, options: Reconstruction) -> Figure:
    """Draw errors of reconstructed snapshots, see `draw_reconstruction`."""
    return draw_reconstruction(results, options)
