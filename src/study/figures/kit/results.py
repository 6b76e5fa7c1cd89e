"""Results that the drawing of a figure reads."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from pdrom.core.store import read_table
from pdrom.view.text import plain_words
from study.artifact.paths import TABLE, Place
from study.figures.kit.holdings import Holdings
from study.figures.kit.options import Options


class NothingToDraw(Exception):
    """A configuration holds nothing of what a figure shows; the message names what is missing."""


def asked(options: Options) -> str:
    """Words for what the options ask for."""
    scenes = ", ".join(options.names("scenes")) or "any scene"
    methods = ", ".join(options.names("methods"))
    return f"{scenes} with {methods}" if methods else scenes


class Results:
    """Results of one configuration, as far as it holds them.

    Parameters
    ----------
    folder : where the results lie
    settings : values of the configuration by their keys
    published : folder with the published code's own output (CSV); None: nothing of it is drawn
    """

    def __init__(
        self,
        folder: str,
        holdings: Holdings,
        settings: Mapping[str, float] | None = None,
        published: Path | None = None,
    ) -> None:
        self.folder = folder
        self.holdings = holdings
        self.settings = dict(settings or {})
        self.published = published

    def experiments(self, options: Options) -> list[tuple[str, str]]:
        """(scene, group) pairs of ``options`` that are drawn."""
        return self.holdings.experiments(options)

    def scenes(self, options: Options) -> list[str]:
        """Scenes of ``options`` that are drawn and in which a group is reduced."""
        return list(dict.fromkeys(scene for scene, _ in self.experiments(options)))

    def methods(self, options: Options) -> list[str]:
        """Methods of ``options`` that are drawn."""
        return self.holdings.reductions(options)

    def method_title(self, method: str) -> str:
        """Title of a method, ready to be drawn; its name where it is not held."""
        held = self.holdings.methods.get(method)
        return plain_words(held.title if held else method)

    def experiment_title(self, scene: str, group: str) -> str:
        """Title of an experiment; the group is named only where the scene reduces several."""
        several = len(self.holdings.scenes[scene].groups) > 1
        name = scene.replace("_", " ")
        return f"{name}: {group.replace('_', ' ')}" if several else name

    def scenes_of(self, table: pd.DataFrame, options: Options, nothing: str) -> list[str]:
        """Scenes of ``options`` that have a row in ``table``; without any, `NothingToDraw`.

        nothing : its message
        """
        scenes = [scene for scene in self.scenes(options) if (table.scene == scene).any()]
        if not scenes:
            raise NothingToDraw(nothing)
        return scenes

    def asked_rows(self, name: str, options: Options) -> pd.DataFrame:
        """Rows of table ``name`` of the scenes and methods that ``options`` name, or of all."""
        table = self.table(name)
        for key, column in (("scenes", "scene"), ("methods", "method")):
            if names := options.names(key):
                table = table[table[column].isin(names)]
        return table

    def held_rows(self, table: pd.DataFrame, options: Options) -> pd.DataFrame:
        """Rows of ``table`` of the experiments and methods of ``options`` that are drawn."""
        pairs = pd.MultiIndex.from_frame(table[["scene", "group"]])
        held = pairs.isin(self.experiments(options))
        return table[held & table.method.isin(self.methods(options))]

    def path(self, place: Place, scene: str, group: str = "", method: str = "") -> str:
        """Path of a result of ``place`` with the labels ``scene``, ``group`` and ``method``."""
        return self.holdings.path(place, self.folder, scene, group, method)

    def table(self, name: str) -> pd.DataFrame:
        """Table ``name`` with the columns of its declaration; StorageError if it is missing."""
        return read_table(TABLE.at(self.folder, name=name))

    def published_table(self, name: str, columns: Sequence[str]) -> pd.DataFrame | None:
        """Table ``name`` (``columns``) of the published code's own output; None if not drawn."""
        if self.published is None:
            return None
        return read_table(self.published / f"{name}.csv", columns, result=False)
