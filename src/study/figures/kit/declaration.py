"""Declaration of a figure: title, caption, inputs, scenes, and the function that draws it.

A figure is declared by a decorator on its drawing function in a module of `study.figures`, whose
docstring is the caption::

    @figure(
        title="Rest shapes",
        reads={"meshes": EachOf(MESH, "drawn.experiments")},
        scenes="strain_oop bar_release",
    )
    def rest_shapes(drawn: Drawn, meshes: list[File]) -> Figure:
        'Vertices of each mesh.'
"""

import logging
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import BaseModel

from pdrom.core.store import atomic_path
from pdrom.model import constraints
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import EffectConfigs
from pdrom.view import style
from pdrom.view.artists import Figure, Line2D
from pdrom.view.camera import Camera, up_of
from study.artifact import words
from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.paths import FIGURE, FIGURE_PICTURE, File
from study.artifact.reads import Read, Setting, TableOf
from study.artifact.text import to_plain
from study.tables.effects_cost import unreliable

MESHES = "disc_strain ball_shell torus_release starfish_twist"  # scenes of config/extended.yaml
# Method, or mesh of the full-order model -> colour and marker.
METHODS: dict[str, tuple[str, str]] = {
    "fom": (style.BLACK, "o"),
    "coarser-mesh": (style.ORANGE, "H"),
    "published": (style.VERMILLION, "v"),
    "deim-joint": ("#7A5C00", "D"),
    "deim": (style.PURPLE, "s"),
    "qdeim": ("#882255", "^"),
    "block-deim": (style.SKY, "P"),
    "block-qdeim": ("#332288", "X"),
    "gappy": (style.BLUE, "<"),
    "bounded": ("#44AA99", "*"),
    "pod": (style.GREY, "d"),
    "ecsw": (style.GREEN, ">"),
}
_RESERVE = (("#5A5A5A", "1"), ("#9A6A00", "2"), ("#6B3F00", "3"), ("#2B2B80", "4"))
_GROUPS = [name for name in EFFECTS if EFFECTS[name].startswith(constraints.__name__)]
# Constraint group -> colour and marker.
GROUPS = dict(zip(_GROUPS, cycle(style.GROUP_LOOKS), strict=False))
AZIMUTH = 30.0  # azimuth of every camera, degrees


class NothingToDraw(Exception):
    """Raised if a configuration has no data for a figure."""


def held(table: pd.DataFrame) -> pd.DataFrame:
    """Return ``table``; raise NothingToDraw if it has no row."""
    if table.empty:
        raise NothingToDraw
    return table


def camera_of(experiment: "Experiment", elevation: float = 20.0) -> Camera:
    """Return the camera for pictures of the scene of ``experiment`` (elevation in degrees)."""
    return Camera(AZIMUTH, elevation, tuple(up_of(experiment.effects).tolist()))


def method_styles(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Map each method to (colour, marker); methods not in `METHODS` share a few spare styles."""
    others = sorted({*names} - {*METHODS})
    looks = METHODS | dict(zip(others, cycle(_RESERVE), strict=False))
    return {name: looks[name] for name in names}


class Experiment(BaseModel, extra="forbid", frozen=True):
    """A constraint group (all constraints of one kind) that is reduced in a scene.

    mesh, effects : identifier of the mesh of the scene, and all effects of the scene
    only : whether the scene reduces no other group
    method : reduction method, as in the paths of files; empty: all methods
    """

    scene: str
    group: str
    mesh: str
    effects: EffectConfigs
    only: bool
    method: str = ""

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules of the scene's effects; their code determines drawn elements and obstacles."""
        return tuple(sorted({EFFECTS[effect.effect] for effect in self.effects}))

    @property
    def labels(self) -> dict[str, str]:
        """Mapping of "scene", "group" ... to their values in the paths of files."""
        labels = {"scene": self.scene, "group": self.group, "mesh": self.mesh}
        return labels | ({"method": self.method} if self.method else {})

    @property
    def title(self) -> str:
        """Title of a panel; the group is named only if the scene reduces several groups."""
        scene = words.scene(self.scene)
        return scene if self.only else f"{scene}: {style.words(self.group)}"

    def find(self, files: Sequence[File], **labels: str) -> str:
        """Return the first path in ``files`` for this experiment and ``labels``, else ""."""
        own = self.labels | labels
        found = (f.path for f in files if all(own.get(k, v) == v for k, v in f.labels.items()))
        return next(found, "")


class Reduction(BaseModel, extra="forbid", frozen=True):
    """Reduction method: title, and kind of rows that it samples (as in `MethodSpec.rows`)."""

    title: str
    rows: str


class Drawn(BaseModel, extra="forbid", frozen=True):
    """Experiments and methods that a figure draws, in the order of drawing.

    experiments : each is a scene with one of its reduced groups
    reductions : name of a method -> its description
    """

    experiments: tuple[Experiment, ...]
    reductions: dict[str, Reduction]

    @property
    def runs(self) -> list[Experiment]:
        """All combinations of experiments and methods."""
        return [
            experiment.model_copy(update={"method": method})
            for experiment in self.experiments
            for method in self.reductions
        ]

    @property
    def first_run(self) -> list[Experiment]:
        """First of the `runs`; empty if there are no runs."""
        return self.runs[:1]

    @property
    def scenes(self) -> list[str]:
        """Names of the scenes in ``experiments``, each once, in the order of drawing."""
        return list(dict.fromkeys(experiment.scene for experiment in self.experiments))

    @property
    def methods(self) -> list[str]:
        """Names of the selected reduction methods."""
        return list(self.reductions)

    @property
    def looks(self) -> dict[str, tuple[str, str]]:
        """Name of each selected method -> (colour, marker)."""
        return method_styles(self.methods)

    def of(self, scene: str) -> list[Experiment]:
        """Return the experiments in ``scene``: one for each of its reduced constraint groups."""
        return [experiment for experiment in self.experiments if experiment.scene == scene]

    def groups_of(self, scene: str) -> str:
        """Return the name of the reduced constraint group of ``scene``, or "several groups"."""
        groups = [experiment.group for experiment in self.of(scene)]
        return style.words(groups[0]) if len(groups) == 1 else "several groups"

    def title(self, method: str) -> str:
        """Return words for ``method``."""
        known = self.reductions.get(method)
        return style.plain_words(words.method(method, known.title if known else ""))

    def handles(self, looks: Mapping[str, tuple[str, str]], **common: Any) -> list[Line2D]:
        """Return legend entries for ``looks`` (method -> colour, marker); ``common``: options."""
        return [
            style.handle(self.title(method), color=colour, marker=marker, **common)
            for method, (colour, marker) in looks.items()
        ]

    def scenes_of(self, table: pd.DataFrame) -> list[str]:
        """Return the scenes with rows in ``table``; raise NothingToDraw if there are none."""
        present = set(held(table[table.scene.isin(self.scenes)]).scene)
        return [scene for scene in self.scenes if scene in present]

    def styles(self, table: pd.DataFrame) -> dict[str, tuple[str, str]]:
        """Return `looks` of methods with rows in ``table``; raise NothingToDraw without rows."""
        present = set(held(table[table.method.isin(self.methods)]).method)
        return {method: look for method, look in self.looks.items() if method in present}

    def rows(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return rows with selected scene, group and method; raise NothingToDraw without rows."""
        pairs = pd.MultiIndex.from_frame(table[["scene", "group"]])
        drawn = pairs.isin([(each.scene, each.group) for each in self.experiments])
        return held(table[drawn & table.method.isin(self.methods)])


log = logging.getLogger(__name__)

PNG_DPI = 200
RASTER_DPI = 300  # dots per inch of the rasterised parts of a PDF
TIMES = "times_of_run"  # input of a timed figure: table that tells whether times are reliable
DISTURBED = "these times are unreliable: other programs used the processor"
NO_DATA = "no data in this configuration; the full study (config/default.yaml) draws this figure"


@dataclass(frozen=True)
class Declaration(Artifact):
    """Figure of the study, named after the function that draws it.

    title, caption : text in the mark-up of `study.artifact.text`; ``{key}`` in a caption stands
        for the value of a setting
    number : number of the figure of the preprint that this one reproduces; None if there is none
    scenes, methods : names in the order of drawing, separated by blanks; names that the study lacks
        are left out. A study with none of them draws all its methods, and all its scenes that fit:
    groups, several : scenes fit that reduce one of ``groups`` (empty: any), or several groups
    """

    caption: str = ""
    number: int | None = None
    scenes: str = ""
    methods: str = ""
    groups: str = ""
    several: bool = False
    rule_pattern = "figure_{}"

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Draw the figure in a workflow job and write it as PDF and PNG."""
        drawn = self.draw(**self.read(settings, inputs))
        write_figure(drawn, to_plain(self.title), outputs["pdf"], png=outputs["png"])

    def draw(self, **read: Any) -> Figure:
        """Draw the figure, or a note without data; StorageError for a missing or damaged file."""
        times = read.pop(TIMES, None)
        with style.look():
            try:
                if "drawn" in read and not read["drawn"].experiments:
                    raise NothingToDraw
                drawn = self.function(**read)
            except NothingToDraw:
                log.info("figure %s: no data", self.name)
                drawn = style.new_figure(0.45, None)
                drawn.text(0.5, 0.5, NO_DATA, ha="center", va="center", color="#444444")
                return drawn
            if times is not None and unreliable(times):
                drawn.suptitle(DISTURBED, fontsize=8, color=style.FAILED)
            return drawn


def figure(
    *, title: str, reads: Mapping[str, Read], more: str = "", timed: bool = False, **fields: Any
) -> Callable[[Callable[..., Figure]], Declaration]:
    """Return a decorator that declares a function as the drawing of a figure.

    The function gets the inputs ``reads``. A parameter ``drawn`` gets the experiments and methods
    that the figure draws, selected by ``fields`` of `Declaration`. The caption is the docstring of
    the function followed by ``more``; line breaks count as blanks. A ``timed`` figure draws times,
    with a note if they are unreliable.

    Raises TypeError if the docstring is missing, or if the parameters do not match ``reads``.
    """

    def decorate(function: Callable[..., Figure]) -> Declaration:
        name = function.__name__
        if not function.__doc__:
            raise TypeError(f"figure {name}: the function has no docstring, which is its caption")
        drawn = {"drawn": Setting("drawn")} if "drawn" in function.__annotations__ else {}
        writes = {"pdf": FIGURE.where(name=name), "png": FIGURE_PICTURE.where(name=name)}
        caption = " ".join([*function.__doc__.split(), *more.split()])
        made = Declaration(
            name, title, {**drawn, **reads}, writes, function, caption=caption, **fields
        )
        times = {TIMES: TableOf("frame_times")} if timed else {}
        return replace(declare(made), reads={**made.reads, **times})

    return decorate


def write_figure(
    figure: Figure, title: str, pdf: str | os.PathLike[str], png: str | os.PathLike[str]
) -> None:
    """Write ``figure`` to the files ``pdf`` and ``png``, with ``title`` in their metadata.

    The files have no dates, so that repeated calls write the same bytes.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    document = {"Title": title, "Creator": "pdrom", "CreationDate": None, "ModDate": None}
    with style.look():
        with atomic_path(Path(pdf)) as temporary:
            figure.savefig(temporary, format="pdf", dpi=RASTER_DPI, metadata=document)
        with atomic_path(Path(png)) as temporary:
            figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata={"Title": title})


@cache
def declarations() -> dict[str, Declaration]:
    """Return all figures by name: those of the preprint by number, then the others by name."""
    found = declared_in("study.figures", Declaration)
    return dict(sorted(found.items(), key=lambda item: (item[1].number or math.inf, item[0])))
