"""Options of figures: the keys that several of them share."""

from typing import Annotated, Literal

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.view.camera import Camera

Rank = Annotated[int, Field(ge=0)] | Literal["full"]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Split = Literal["train", "test", "heldout"]
Names = tuple[str, ...]


class Options(ConfigModel):
    """A figure without a choice; the others add keys.

    Whatever a configuration does not hold is left out of the picture, and an empty list of names
    means all there is.
    """

    def names(self, key: str) -> Names:
        """Chosen names under ``key``; empty where the figure has no such choice."""
        return getattr(self, key, ())


class Scenes(Options):
    """Scenes, in the order in which they are drawn."""

    scenes: Names = ()


class Experiments(Scenes):
    """Scenes, and groups that are reduced in them."""

    groups: Names = ()


class Methods(Options):
    """Reduction methods, in the order in which they are drawn."""

    methods: Names = ()


class Ranks(Options):
    """Basis sizes; ``full`` is the full numerical rank."""

    ranks: tuple[Rank, ...] = ()


class Instants(Options):
    """Instants as fractions of the run (1 is its last frame)."""

    frames: Annotated[tuple[Fraction, ...], Field(min_length=1)] = (0.1, 0.5, 0.9)


class View(Options):
    """Camera, degrees; y points up."""

    azimuth: Annotated[float, Field(ge=-180.0, le=180.0)] = 30.0
    elevation: Annotated[float, Field(ge=-90.0, le=90.0)] = 20.0

    @property
    def camera(self) -> Camera:
        """The camera."""
        return Camera(self.azimuth, self.elevation)


class Columns(Options):
    """Panels side by side."""

    columns: Annotated[int, Field(ge=1, le=6)] = 3


class Count(Options):
    """Number of modes or iterations that are drawn."""

    count: Annotated[int, Field(ge=1, le=12)] = 6


class Splits(Options):
    """Sets of snapshots: used for the basis, between them, of another run."""

    splits: tuple[Split, ...] = ("train", "test", "heldout")


class Beside(Options):
    """Scene -> experiment of the published code whose output is drawn beside ours."""

    published: dict[str, str] = Field(default_factory=dict)


class Reconstruction(Experiments, Methods, Splits, Columns, Beside):
    """Errors of reconstructed snapshots."""


class ReducedRuns(Experiments, Methods, Ranks, Instants, View):
    """Full-order runs beside reduced ones."""
