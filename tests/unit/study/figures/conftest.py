"""Results of invented studies in the documented formats: bent sheets, a bar, random bases."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from builders import frame
from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import read_yaml
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh, save_mesh
from pdrom.reduction.basis import Basis, save_basis
from pdrom.reduction.method import load_methods
from pdrom.reduction.sampling import select_path
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, save_snapshots
from places import CONFIG, ROOT
from study.artifact import paths
from study.artifact.reads import TableOf
from study.figures.kit.declaration import declarations
from study.pipeline.folders import Folders
from study.pipeline.plan import Job, Plan
from study.pipeline.study import Study
from study.tables import declared

FRAMES = 20
METHODS = ("pod", "deim", "qdeim", "deim-joint", "published", "block-deim")
SCENES = (
    "cloth_all", "bend_fall", "bend_curved", "spring_stretch", "spring_twist", "spring_twist_twin",
    "strain_twist", "strain_oop", "bar_release", "bar_twist",
)  # fmt: skip
FLAT = ("bend_fall",)  # scenes whose projections are rounding errors
BLOWN_UP = ("spring_twist", "deim-joint", 10)  # scene, method and r of a diverged run
BLOWUP_FRAME = 4
SETTINGS = {
    **read_yaml(CONFIG / "default.yaml"),
    "noise": {"cases": {"bend_fall": "bending"}},
    "subspace": {"sizes": []},
}


class Invented:
    """An invented study on disk, below ``root``; a test may change its ``study``."""

    def __init__(self, root: Path, scenes: Sequence[str], methods: Sequence[str]) -> None:
        self.root = root
        self.settings = SETTINGS | {"scenes": list(scenes), "methods": list(methods)}
        self.study = Study(self.settings, ROOT)
        make_results(self)

    def path(self, place: paths.Place, scene: str, group: str = "", method: str = "") -> str:
        labels = {"scene": scene, "group": group, "method": method}
        return Plan(self.study, Folders(str(self.root))).file(place, labels)

    def job(self, name: str, root: Path | None = None, **changes: object) -> Job:
        """Job of a figure with other scenes or methods than it declares."""
        names = {key: " ".join(value) for key, value in changes.items()}
        figure = replace(declarations()[name], **names)
        with patch.dict(declarations(), {name: figure}):
            return Plan(self.study, Folders(str(root or self.root))).job(figure, {})

    def read(self, name: str, root: Path | None = None, **changes: object) -> dict[str, object]:
        """Inputs of the function of a figure."""
        job = self.job(name, root, **changes)
        return job.artifact.read(job.settings, job.inputs)

    def draw(self, name: str, tables: Mapping[str, object] = {}, **changes: object) -> Figure:
        """Draw a figure from other ``tables``, by the names of its inputs."""
        return declarations()[name].draw(**{**self.read(name, **changes), **tables})


def mesh_of(scene: str) -> Mesh:
    if scene.startswith("bar"):
        return bar(7, 3, 3)
    return cloth(7, 6, wave=0.1 if scene == "bend_curved" else 0.0)


def make_results(results: Invented) -> None:
    rng = np.random.default_rng(7)
    for scene, config in results.study.scenes.items():
        mesh = mesh_of(scene)
        save_mesh(mesh, results.path(paths.MESH, scene))
        # the mesh bends increasingly and sinks to the floor
        t = np.linspace(0.0, 1.0, FRAMES + 1)[:, None]
        positions = np.repeat(mesh.points[None], FRAMES + 1, axis=0)
        positions[:, :, 2] += 0.4 * t * np.sin(4.0 * mesh.points[:, 0])
        positions[:, :, 1] -= 1.5 * t**2
        for place in (paths.TRAIN, paths.HELDOUT):
            with write_hdf5(results.path(place, scene)) as file:
                file["positions"] = positions
        for group in config.reduce:
            rank = 0 if scene in FLAT else 14
            count = len(EFFECTS.load(group).element_vertices(mesh))
            basis = _write_bases(results, scene, group, count, rank, rng)
            for method, spec in results.study.methods.items():
                chosen = select_path(basis, spec, range(1, rank + 1))
                with write_hdf5(results.path(paths.SAMPLING, scene, group, method)) as file:
                    for r, sampling in chosen.items():
                        store = file.create_group(f"r{r:04d}")
                        store["entries"] = sampling.entries
                        store["elements"] = sampling.elements
                _write_reruns(results, scene, group, method, positions, rank, rng)
        if scene in FLAT:
            _write_noise_runs(results, scene)
        _write_floors(results, scene)
    _write_tables(results)


def _write_bases(results, scene, group, count, rank, rng) -> Basis:
    rows = EFFECTS.load(group).rows_per_element
    size = 3 * rows * count
    V = np.linalg.qr(rng.standard_normal((size, 14)))[0][:, :rank]
    numbers = rank, 1e-12, rows, (True,) * 3
    basis = Basis(V, np.zeros(size), 0.5 ** np.arange(14), *numbers)
    for path in {results.path(paths.BASIS, scene, group, m) for m in results.study.methods}:
        save_basis(basis, path)
    found = {split: rng.standard_normal((10, rows * count, 3)) for split in SPLITS}
    frames = {split: np.arange(0, FRAMES, 2) + (split != "train") for split in SPLITS}
    made = SnapshotSet(**found, frames=frames, row_mass=np.ones(rows * count), elements=count,
                       rows_per_element=rows, roundoff=1e-12)  # fmt: skip
    save_snapshots(made, results.path(paths.SNAPSHOTS, scene, group))
    return basis


def _write_reruns(results, scene, group, method, positions, rank, rng) -> None:
    with write_hdf5(results.path(paths.RERUNS, scene, group, method)) as file:
        for r in (6, 10, 14, 20):
            store, test = (file.create_group(f"{run}r{r:04d}") for run in ("", "heldout/"))
            for own, every in ((store, 1), (test, 4)):
                own.attrs.update(r=r, full=r == rank, marked=r > rank, every=every)
            if r > rank:
                continue
            failed = (scene, method, r) == BLOWN_UP
            last = BLOWUP_FRAME if failed else FRAMES
            moved = positions[: last + 1] + 0.02 / r * rng.standard_normal(positions[0].shape)
            if failed:
                moved[-1] = np.nan
            blowup = BLOWUP_FRAME if failed else -1
            for own in (store, test):
                own["positions"] = moved[:: own.attrs["every"]].astype(np.float32)
                own.attrs.update(blowup_frame=blowup)


def reference(name: str) -> pd.DataFrame:
    """The tracked table of the full or the tiny study, with invented times."""
    folders = (ROOT / "results/reference/tables", ROOT / "results/reference/studies/tiny/tables")
    path = next(path for folder in folders for path in folder.glob(f"{name}.csv*"))
    table, made = pd.read_csv(path), declared()[name]
    invented = {"text": "a", "flag": True, "integer": 9}
    for column in made.columns:
        if column.name not in table:
            values = np.random.default_rng(len(column.name)).uniform(0.5, 2.0, len(table))
            table[column.name] = invented.get(column.kind, values)
    return made.checked(table)


def _write_tables(results: Invented) -> None:
    """The rows of the study's scenes and methods in the tables that figures read."""
    others = {*load_methods(CONFIG / "methods.yaml")} - {*results.study.methods}
    reads = [read for made in declarations().values() for read in made.reads.values()]
    for name in {read.name for read in reads if isinstance(read, TableOf)}:
        table = reference(name)
        if "scene" in table:
            table = table[table.scene.isin(list(results.study.scenes))]
        if "method" in table:
            table = table[~table.method.isin(others)]
        write_table(table, paths.TABLE.at(str(results.root), name=name))


def _write_noise_runs(results, scene) -> None:
    """Runs that do not start if rounding errors stay in the plane; otherwise the sheet at rest."""
    points = mesh_of(scene).points
    with write_hdf5(results.path(paths.NOISE_RUNS, scene, "bending")) as file:
        for axes, frames in (("all", FRAMES), ("plane", 0), ("vertex", FRAMES)):
            for r in (6, 10):
                store = file.create_group(f"{axes}/deim-joint/r{r:04d}")
                store["positions"] = np.repeat(points[None], frames + 1, axis=0)
                store.attrs.update(r=r, marked=r > 9, blowup_frame=-1 if frames else 0)


def _write_floors(results, scene) -> None:
    """Sensitivities, which rise for springs only."""
    floors = [
        (scene, label, i, 10.0 ** (-9 + (0.5 * i if "spring" in scene else 0.05)))
        for label in ("1e-10", "solver")
        for i in range(FRAMES)
    ]
    names = "scene perturbation frame relative_difference"
    write_table(frame(names, *floors), results.path(paths.SENSITIVITY, scene))


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Invented:
    return Invented(tmp_path_factory.mktemp("results"), SCENES, METHODS)


@pytest.fixture
def small_study(tmp_path) -> Callable[[Sequence[str], Sequence[str]], Invented]:
    """Function that makes a study with other scenes and methods, which a test may change."""
    return partial(Invented, tmp_path)


@pytest.fixture(scope="session")
def strain_only(tmp_path_factory) -> Invented:
    return Invented(tmp_path_factory.mktemp("strain"), ["strain_oop"], ["deim", "block-deim"])


@pytest.fixture(scope="session")
def round_off_only(tmp_path_factory) -> Invented:
    methods = ["deim", "deim-joint", "block-deim"]
    return Invented(tmp_path_factory.mktemp("flat"), ["bend_fall"], methods)


@pytest.fixture(params=list(declarations()))
def figure_name(request) -> str:
    return request.param
