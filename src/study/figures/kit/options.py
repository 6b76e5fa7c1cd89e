"""Options of a figure, and the part of the study that these options select."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import pandas as pd
from pydantic import BaseModel, ConfigDict, Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import EffectConfigs
from pdrom.view import style
from pdrom.view.artists import Line2D
from pdrom.view.camera import Camera, up_of
from pdrom.view.text import plain_words
from study.artifact.paths import File

Names = tuple[str, ...]
Ranks = tuple[Annotated[int, Field(ge=0)] | Literal["full"], ...]  # full: the numerical rank
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Instants = Annotated[tuple[Fraction, ...], Field(min_length=1)]  # fractions of a run's length
Columns = Annotated[int, Field(ge=1, le=6)]  # panels side by side
Count = Annotated[int, Field(ge=1, le=12)]  # number of modes or iterations
AZIMUTH = 30.0  # azimuth of every camera, degrees


class NothingToDraw(Exception):
    """The configuration has no data for a figure; the message names the missing data."""


class Options(ConfigModel):
    """Options of a figure without choices; subclasses add keys.

    Chosen names that the configuration lacks are not drawn. An empty list of names, or a list whose
    names are all absent, selects everything in the configuration.
    """

    def names(self, key: str) -> Names:
        """Chosen names under ``key`` (scenes, methods); empty if the figure has no such option."""
        return getattr(self, key, ())

    def words(self) -> str:
        """Text that names the chosen scenes and methods."""
        scenes = ", ".join(self.names("scenes")) or "any scene"
        methods = ", ".join(self.names("methods"))
        return f"{scenes} with {methods}" if methods else scenes

    def rows(self, table: pd.DataFrame) -> pd.DataFrame:
        """Rows of ``table`` for the chosen scenes and methods; an empty choice selects all."""
        for key, column in (("scenes", "scene"), ("methods", "method")):
            if names := self.names(key):
                table = table[table[column].isin(names)]
        return table


class Scenes(Options):
    """Options: scenes, in the order in which they are drawn."""

    scenes: Names = ()


class Methods(Scenes):
    """Options: scenes and reduction methods, in the order in which they are drawn."""

    methods: Names = ()


class View(Methods):
    """Options: elevation of the camera, degrees; up is opposite to the gravity of a scene."""

    elevation: Annotated[float, Field(ge=-90.0, le=90.0)] = 20.0

    def camera(self, experiment: "Experiment") -> Camera:
        """Camera for the scene of ``experiment``."""
        return Camera(AZIMUTH, self.elevation, tuple(up_of(experiment.effects).tolist()))


class Beside(Scenes):
    """Options: panels per row, and scene -> experiment of the published code drawn with it."""

    columns: Columns = 3
    published: dict[str, str] = Field(default_factory=dict)


class ReducedRuns(View):
    """Options: basis sizes and instants at which full-order and reduced runs are drawn."""

    ranks: Ranks = ()
    frames: Instants = (0.1, 0.5, 0.9)


class _Plain(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Experiment(_Plain):
    """A constraint group that is reduced in a scene.

    mesh, effects : identifier of the scene's mesh, and all of its effects
    only : whether the scene reduces no other group
    """

    scene: str
    group: str
    mesh: str
    effects: EffectConfigs
    only: bool

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules of the scene's effects, which define element positions and obstacle shapes."""
        return tuple(sorted({EFFECTS[effect.effect] for effect in self.effects}))

    @property
    def labels(self) -> dict[str, str]:
        """Labels that identify the files of the experiment."""
        return {"scene": self.scene, "group": self.group, "mesh": self.mesh}

    @property
    def title(self) -> str:
        """Title of a panel; the group is named only if the scene reduces several groups."""
        name = self.scene.replace("_", " ")
        return name if self.only else f"{name}: {self.group.replace('_', ' ')}"

    def find(self, files: Sequence[File], **labels: str) -> str | None:
        """Path of the first of ``files`` with the experiment's and further ``labels``, or None."""
        own = self.labels | labels
        found = (f.path for f in files if all(own.get(k, v) == v for k, v in f.labels.items()))
        return next(found, None)

    def path(self, files: Sequence[File], **labels: str) -> str:
        """Path of the first matching file, see `find`; raise LookupError if there is none."""
        path = self.find(files, **labels)
        if path is None:
            raise LookupError(f"no file of {self.labels | labels}")
        return path


class Reduction(_Plain):
    """Title of a reduction method, and the rows that it samples (`MethodSpec.rows`)."""

    title: str
    rows: str


class Drawn(_Plain):
    """Part of a study that a figure draws: experiments and methods selected by its options.

    experiments, reductions : selected experiments, and methods by name, in the requested order
    groups : all constraint groups of the model, whose order decides their colours
    """

    experiments: tuple[Experiment, ...]
    reductions: dict[str, Reduction]
    groups: tuple[str, ...]

    @property
    def scenes(self) -> list[str]:
        """Scenes of the experiments, each once."""
        return list(dict.fromkeys(experiment.scene for experiment in self.experiments))

    @property
    def methods(self) -> list[str]:
        """Names of the selected reduction methods."""
        return list(self.reductions)

    @property
    def looks(self) -> dict[str, tuple[str, str]]:
        """(colour, marker) of every constraint group."""
        looks = style.GROUP_LOOKS
        return {group: looks[place % len(looks)] for place, group in enumerate(self.groups)}

    def of(self, scene: str) -> list[Experiment]:
        """Experiments in ``scene``, one per reduced constraint group."""
        return [experiment for experiment in self.experiments if experiment.scene == scene]

    def title(self, method: str) -> str:
        """Title of ``method``, ready to be drawn; its name if the method is not selected."""
        held = self.reductions.get(method)
        return plain_words(held.title if held else method)

    def handles(self, looks: Mapping[str, tuple[str, str]], **common: Any) -> list[Line2D]:
        """Legend entries titled by method, with (colour, marker) ``looks`` and ``common`` style."""
        return [
            style.handle(self.title(method), color=colour, marker=marker, **common)
            for method, (colour, marker) in looks.items()
        ]

    def scenes_of(self, table: pd.DataFrame, nothing: str) -> list[str]:
        """Scenes that have a row in ``table``; raise `NothingToDraw` if there are none.

        nothing : message of the exception
        """
        scenes = [scene for scene in self.scenes if (table.scene == scene).any()]
        if not scenes:
            raise NothingToDraw(nothing)
        return scenes

    def rows(self, table: pd.DataFrame) -> pd.DataFrame:
        """Rows of ``table`` whose experiment and method are selected."""
        pairs = pd.MultiIndex.from_frame(table[["scene", "group"]])
        held = pairs.isin([(each.scene, each.group) for each in self.experiments])
        return table[held & table.method.isin(self.methods)]
