"""The results of one scene, as drawings read them."""

from collections.abc import Iterable, Mapping, Sequence

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.paths import (
    RECONSTRUCTION,
    RERUNS,
    RERUNS_TRAIN,
    SENSITIVITY,
    SUBSPACES,
    SUBSPACES_TRAIN,
    TIMINGS,
    File,
    Place,
)
from pdrom.core.store import read_table
from pdrom.model.effects.base import EffectConfig
from pdrom.report.figures.kit.holdings import Holdings
from pdrom.report.figures.kit.options import Rank
from pdrom.report.figures.kit.results import Results
from pdrom.tables.kit.one_time import NOT_TIMED
from pdrom.tables.reconstruction_error import reconstruction_error
from pdrom.tables.reduced_reruns import reduced_reruns


class SceneResults(Results):
    """Results of ``scene``; what drawings call tables of the study are made of its own files."""

    def __init__(
        self,
        scene: str,
        folder: str,
        holdings: Holdings,
        settings: Mapping[str, float],
        ranks: tuple[Rank, ...] = (),
        title: str = "",
        subspaces: bool = False,
        effects: tuple[EffectConfig, ...] = (),
    ) -> None:
        super().__init__(folder, holdings, settings)
        self.scene = scene
        self.ranks = ranks
        self.title = title
        self.effects = effects
        self._subspaces = subspaces

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups that are reduced."""
        return self.holdings.scenes[self.scene].groups

    @property
    def reductions(self) -> list[tuple[str, str]]:
        """(group, method) pairs that were run."""
        return [(group, method) for group in self.groups for method in self.holdings.methods]

    def table(self, name: str, columns: Sequence[str] = ()) -> pd.DataFrame:
        """Rows of the scene as the study's table has them; StorageError for another table."""
        if name == "sensitivity":
            return read_table(self.path(SENSITIVITY, self.scene), columns)
        if name == "reconstruction_error":
            return reconstruction_error(self._files(RECONSTRUCTION))
        if name == "reduced_reruns":
            return self._reduced_reruns()
        if name == "repetitions":
            return pd.DataFrame(columns=list(columns))  # a scene by itself repeats no run
        raise StorageError(f"scene {self.scene}: the table {name} is made of whole studies only")

    def runs(self) -> pd.DataFrame:
        """Reduced runs of the training motion with times and what was sampled.

        A row per group, method and r, then those in position subspaces.
        """
        runs = self.table("reduced_reruns")
        if not self.reductions:
            return runs.reindex(columns=[*runs.columns, *_SAMPLED])
        errors = self.table("reconstruction_error")
        sampled = errors[errors.split == "train"].assign(position_basis="full")
        keys = ["scene", "group", "method", "position_basis", "r"]
        return runs.merge(sampled[[*keys, *_SAMPLED]], on=keys, how="left")

    def file(self, place: Place) -> File:
        """The scene's only file of a kind."""
        return place.file(self.path(place, self.scene))

    def _reduced_reruns(self) -> pd.DataFrame:
        inside = [SUBSPACES, SUBSPACES_TRAIN] if self._subspaces else []
        subspaces, rows = ([self.file(place)] for place in inside) if inside else ([], [])
        if not self.reductions and not inside:
            return reduced_reruns.checked(pd.DataFrame())
        return reduced_reruns(
            self._files(RERUNS), self._files(RERUNS_TRAIN), subspaces, rows, [self.file(TIMINGS)],
            NOT_TIMED, self.table("sensitivity"), self.settings["sensitivity.reference"],
            self.settings["sensitivity.threshold"],
        )  # fmt: skip

    def _files(self, place: Place) -> list[File]:
        return place.files(self._paths(place))

    def _paths(self, place: Place) -> Iterable[str]:
        for group, method in self.reductions:
            yield self.path(place, self.scene, group, method)


_SAMPLED = ["gain", "rows_sampled", "elements_sampled"]
