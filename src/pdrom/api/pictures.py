"""Pictures of runs."""

import numpy as np
from matplotlib.figure import Figure

from pdrom.api.runs import ReducedRun
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.multiples import clipped, log_axis

LOW, HIGH = 1e-7, 1e3  # errors outside are drawn on the limit


def plot(*runs: ReducedRun) -> Figure:
    """Errors of reduced runs against time; a cross ends a run that blew up.

    ``plot(...).savefig("errors.png")`` writes the picture.
    """
    with style.look():
        figure = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
        ax = figure.subplots()
        log_axis(ax, LOW, HIGH)
        for i, reduced in enumerate(runs):
            time = reduced.full.scene.config.time_step * np.arange(1, len(reduced.error) + 1)
            colour, shown = style.CYCLE[i % len(style.CYCLE)], clipped(reduced.error, LOW, HIGH)
            ax.plot(time, shown, color=colour, label=reduced.title)
            if not reduced.outcome.finite and len(time):
                ax.plot(time[-1:], shown[-1:], color=colour, marker="x", markersize=5)
        ax.set_xlim(0.0, None)
        ax.set_xlabel("time in s")
        ax.set_ylabel("relative error")
        ax.legend(loc="upper left")
    return figure
