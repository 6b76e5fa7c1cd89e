"""Common style of all figures: fonts, colours, markers, legends and axis helpers."""

import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np

from pdrom.view.artists import Artist, Axes, Figure, Line2D, Patch

WIDTH = 6.53  # inches, text width of the manuscript
DIGITS = 6  # decimals of the positions of axes, which are fractions of the figure

# Palette of Okabe and Ito (2008), distinguishable with every common colour vision deficiency.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
GREY = "#8C8C8C"
FAILED = "#B3261E"
FULL_ORDER = "#DAD6CC"

# Colours and markers of the constraint groups in the order of `EFFECTS`; they repeat if too few.
GROUP_LOOKS = (
    (GREEN, "^"), (ORANGE, "s"), (BLUE, "o"), (SKY, "D"), (PURPLE, "v"), (VERMILLION, "P"),
    ("#7A5C00", "X"), ("#5A5A5A", "<"), ("#2B2B80", ">"),
)  # fmt: skip
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)

RC: dict[str, Any] = {
    "font.sans-serif": ["DejaVu Sans"], "font.size": 8.0, "axes.titlesize": 8.0,
    "axes.labelsize": 8.0, "xtick.labelsize": 7.5, "ytick.labelsize": 7.5, "legend.fontsize": 8.0,
    "legend.frameon": False, "axes.spines.top": False, "axes.spines.right": False,
    "axes.linewidth": 0.6, "axes.axisbelow": True, "grid.color": "#DDDDDD", "grid.linewidth": 0.5,
    "xtick.major.width": 0.6, "ytick.major.width": 0.6, "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0, "lines.linewidth": 1.1, "lines.markersize": 3.5,
    "hatch.linewidth": 0.5, "pdf.fonttype": 42,
}  # fmt: skip


@contextmanager
def look() -> Iterator[None]:
    """Apply this style to matplotlib's defaults in a context; the user's settings are ignored."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        yield


def surface_colour(colour: str) -> tuple[float, float, float]:
    """Return RGB of ``colour``, lightened for a shaded surface so that shadows stay visible."""
    from matplotlib.colors import to_rgb

    red, green, blue = (0.72 * c + 0.28 for c in to_rgb(colour))
    return red, green, blue


def words(name: str) -> str:
    """Return a ``name`` of the configuration with spaces in place of underscores."""
    return name.replace("_", " ")


def plain_words(text: str) -> str:
    """Return ``text`` with dollar signs escaped, which matplotlib would read as mathematics."""
    return unicodedata.normalize("NFC", text).replace("$", r"\$")


def new_figure(height: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """Make an empty figure of the manuscript's width, ``height`` inches high, with a ``layout``."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.transforms import Bbox

    class RoundedLayout(ConstrainedLayoutEngine):
        """Constrained layout whose positions are the same in every process: they are rounded.

        The layout solver sums in the order of memory addresses, so that positions differ in their
        last bits between drawings, which sometimes changes a digit in the file.
        """

        def execute(self, fig: Figure) -> Any:
            grids = super().execute(fig)
            for ax in fig.axes:
                kept = ax.get_in_layout()
                place = np.round(ax.get_position(original=True).extents, DIGITS)
                ax.set_position(Bbox.from_extents(*place), which="original")
                ax.set_in_layout(kept)  # `set_position` has changed this flag
            return grids

    return Figure(figsize=(WIDTH, height), layout=RoundedLayout() if layout else None)


def handle(label: str, **look: Any) -> Line2D:
    """Make the entry ``label`` of a legend: a line, or a marker, with this ``look``."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **look)


def patch(label: str, **look: Any) -> Patch:
    """Make the entry ``label`` of a legend: a rectangle with this ``look``."""
    from matplotlib.patches import Patch

    return Patch(label=label, **look)


def handles(looks: Mapping[str, tuple[str, str]], **common: Any) -> list[Line2D]:
    """Make legend entries from ``looks`` (label -> (colour, marker)) and ``common`` looks."""
    return [handle(label, color=c, marker=m, **common) for label, (c, m) in looks.items()]


def legend(figure: Figure, entries: Sequence[Artist], columns: int) -> None:
    """Draw a legend of ``entries`` in ``columns`` below all panels of ``figure``."""
    figure.legend(handles=list(entries), loc="outside lower center", ncols=columns)


def log_axis(ax: Axes, low: float, high: float) -> None:
    """Make y of ``ax`` logarithmic from ``low`` to ``high`` with few ticks."""
    from matplotlib.ticker import LogLocator

    ax.set(yscale="log", ylim=(low, high))
    ax.yaxis.set_major_locator(LogLocator(base=10.0, numticks=6))
    ax.grid(True)
