"""The results of one scene that the pipeline made, as pictures and tables read them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core import paths
from pdrom.core.paths import File, Place
from pdrom.core.store import open_hdf5, read_table
from pdrom.experiments.kit.horizon import floor_of, horizon
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import SceneConfig
from pdrom.reduction.local.ranks import Rank
from pdrom.report.figures.kit.read import RerunInfo, choose_ranks, rerun_errors, rerun_infos
from pdrom.report.viewer.runs import ViewedRun, ViewedScene
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.effects_contribution import effects_contribution
from pdrom.tables.heldout_reruns import heldout_reruns
from pdrom.tables.kit.one_time import NOT_TIMED
from pdrom.tables.reconstruction_error import reconstruction_error
from pdrom.tables.reduced_reruns import reduced_reruns

SAMPLED = ["gain", "rows_sampled", "elements_sampled"]


@dataclass(frozen=True)
class SceneResults:
    """Results of ``scene`` below the folder ``folder``.

    methods : titles of the methods that were run, by name
    reference, threshold : perturbation and relative difference that define the horizon
    ranks : basis sizes of the viewer
    subspaces : whether the scene has runs in position subspaces
    """

    folder: str
    scene: SceneConfig
    methods: Mapping[str, str]
    reference: float
    threshold: float
    ranks: tuple[Rank, ...] = ()
    subspaces: bool = False

    def viewed(self) -> ViewedScene:
        """The scene with its runs; times only where they were measured.

        Raises
        ------
        StorageError
            A file of the results is missing or damaged.
        """
        scene = self.scene
        floor = floor_of(read_table(self._path(paths.SENSITIVITY)), scene.name, self.reference)
        end = horizon(floor, self.threshold)
        with open_hdf5(self._path(paths.TRAIN)) as file:
            positions, velocities = file["positions"][...], file["velocities"][...]
            own = float(np.median(file["timings"][...].sum(axis=1)))
        times = self._times()
        compiled = times[times.method.isna() & (times.implementation == "compiled")]
        return ViewedScene(
            name=scene.name,
            title=scene.title,
            mesh=load_mesh(self._path(paths.MESH, mesh=scene.mesh.identifier)),
            time_step=scene.time_step,
            positions=positions,
            ms=float(compiled.ms_per_frame.iloc[0]) if len(compiled) else own,
            floor=floor,
            horizon=end if end < len(floor) else None,
            runs=tuple(self._runs(times[times.position_basis.isna()])),
            effects=scene.effects,
            velocities=velocities,
            tables={
                "runs": self.runs,
                "reconstruction_error": self.projections,
                "effects_contribution": self.effects,
                "accuracy_cost": self.costs,
            },
        )

    def runs(self) -> pd.DataFrame:
        """Reduced runs of the training motion with times and what was sampled.

        A row per group, method and r, then those in position subspaces.
        """
        runs = self._reruns()
        if not self._pairs:
            return runs.reindex(columns=[*runs.columns, *SAMPLED])
        errors = self.projections()
        sampled = errors[errors.split == "train"].assign(position_basis="full")
        keys = ["scene", "group", "method", "position_basis", "r"]
        return runs.merge(sampled[[*keys, *SAMPLED]], on=keys, how="left")

    def projections(self) -> pd.DataFrame:
        """Errors of the projections, as the study's table reconstruction_error has them."""
        return reconstruction_error(self._each(paths.RECONSTRUCTION))

    def effects(self) -> pd.DataFrame:
        """Contribution of each effect, as the study's table effects_contribution has it."""
        return effects_contribution(
            [self._file(paths.CONTRIBUTIONS)],
            self._table(paths.SENSITIVITY),
            self.reference,
            self.threshold,
            self._table(paths.EFFECTS),
            self._table(paths.LEFT_OUT),
        )

    def costs(self) -> pd.DataFrame:
        """Errors and times of every setting, as the study's table accuracy_cost has them."""
        return accuracy_cost(
            self._reruns(),
            self._heldout(),
            [self._file(paths.TIMINGS)],
            NOT_TIMED,
            [self._file(paths.ITERATIONS)],
            [self._file(paths.SUBSPACES_CONVERGED)],
            {self.scene.name: self.scene.iterations},
        )

    def _heldout(self) -> pd.DataFrame:
        inside = [paths.SUBSPACES, paths.SUBSPACES_HELDOUT] if self.subspaces else []
        models, rows = ([self._file(place)] for place in inside) if inside else ([], [])
        return heldout_reruns(
            self._each(paths.RERUNS), self._each(paths.RERUNS_HELDOUT), models, rows,
            self._table(paths.SENSITIVITY), self.threshold,
        )  # fmt: skip

    def _reruns(self) -> pd.DataFrame:
        inside = [paths.SUBSPACES, paths.SUBSPACES_TRAIN] if self.subspaces else []
        models, rows = ([self._file(place)] for place in inside) if inside else ([], [])
        if not self._pairs and not inside:
            return reduced_reruns.checked(pd.DataFrame())
        return reduced_reruns(
            self._each(paths.RERUNS), self._each(paths.RERUNS_TRAIN), models, rows,
            [self._file(paths.TIMINGS)], NOT_TIMED, self._table(paths.SENSITIVITY),
            self.reference, self.threshold,
        )  # fmt: skip

    def _runs(self, times: pd.DataFrame) -> Iterator[ViewedRun]:
        for group, method in self._pairs:
            path = self._path(paths.RERUNS, group=group, method=method)
            ran = [info for info in rerun_infos(path) if not info.marked and info.entries]
            offered = choose_ranks(ran, self.ranks)
            for info in ran:
                error = rerun_errors(path, info)
                same = (times.group == group) & (times.method == method) & (times.r == info.r)
                yield ViewedRun(
                    group=group,
                    method=method,
                    title=self.methods[method],
                    r=info.r,
                    read=_Positions(path, info),
                    error=_finite(error),
                    blowup_frame=info.blowup_frame if info.blowup_frame >= 0 else None,
                    ms=float(times.ms_per_frame[same].iloc[0]) if same.any() else None,
                    on_page=info in offered,
                )

    def _times(self) -> pd.DataFrame:
        columns = ["group", "method", "position_basis", "r", "implementation", "ms_per_frame"]
        path = self._path(paths.TIMINGS)
        return read_table(path, columns) if Path(path).exists() else pd.DataFrame(columns=columns)

    @property
    def _pairs(self) -> list[tuple[str, str]]:
        return [(group, method) for group in self.scene.reduce for method in self.methods]

    def _path(self, place: Place, **labels: str) -> str:
        return place.at(self.folder, scene=self.scene.name, **labels)

    def _file(self, place: Place) -> File:
        return place.file(self._path(place))

    def _table(self, place: Place) -> pd.DataFrame:
        return read_table(self._path(place))

    def _each(self, place: Place) -> list[File]:
        return place.files(self._path(place, group=g, method=m) for g, m in self._pairs)


@dataclass(frozen=True)
class _Positions:
    """Reads the positions of one size up to the last finite frame."""

    path: str
    info: RerunInfo

    def __call__(self) -> np.ndarray:
        with open_hdf5(self.path) as file:
            positions = file[self.info.label]["positions"][...]
        return _finite(positions)


def _finite(frames: np.ndarray) -> np.ndarray:
    """The frames before the first one that is not finite."""
    finite = np.isfinite(frames.reshape(len(frames), -1)).all(axis=1)
    return frames if finite.all() else frames[: int(np.argmin(finite))]
