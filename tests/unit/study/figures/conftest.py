"""Results of invented studies in the documented formats: bent sheets, a bar, random bases."""

from collections.abc import Callable, Sequence
from copy import copy
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import read_yaml
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh, save_mesh
from pdrom.reduction.sampling.deim import block_elements, deim_entries
from places import CONFIG, ROOT
from study.artifact.paths import (
    BASIS,
    CONTRIBUTIONS,
    MESH,
    NOISE_RUNS,
    RERUNS,
    SAMPLING,
    SENSITIVITY,
    SNAPSHOTS,
    TABLE,
    TRAIN,
    Place,
)
from study.figures.kit.declaration import declarations
from study.pipeline.resolve import Job, Resolver
from study.pipeline.study import Study

FRAMES = 20
METHODS = ("pod", "deim", "qdeim", "deim-joint", "published", "block-deim")
SCENES = (
    "cloth_all", "bend_fall", "bend_curved", "spring_stretch", "spring_twist", "spring_twist_twin",
    "strain_twist", "strain_oop", "bar_release", "bar_twist",
)  # fmt: skip
FLAT = ("bend_fall",)  # scenes whose projections are round-off
BLOWN_UP = ("spring_twist", "deim-joint", 10)  # scene, method, r of a run that fails
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
        self.study = Study.load(self.settings, ROOT)
        make_results(self)

    def path(self, place: Place, scene: str, group: str = "", method: str = "") -> str:
        """Path of a file with these labels."""
        labels = {"scene": scene, "group": group, "method": method}
        return Resolver(self.study, str(self.root)).file(place, labels)

    def table(self, name: str) -> str:
        """Path of a table."""
        return TABLE.at(str(self.root), name=name)

    def job(self, name: str, root: Path | None = None, **changes: object) -> Job:
        """Job of a figure whose options have ``changes``."""
        study = copy(self.study)
        options = study.figures[name].model_copy(update=changes)
        study.figures = {**study.figures, name: options}
        return Resolver(study, str(root or self.root)).job(declarations()[name], {})

    def read(self, name: str, root: Path | None = None, **changes: object) -> dict[str, object]:
        """What the function of a figure gets."""
        job = self.job(name, root, **changes)
        return job.artifact.read(job.settings, job.inputs)

    def draw(self, name: str, **changes: object) -> Figure:
        """Draw a figure."""
        return declarations()[name].draw(**self.read(name, **changes))


def mesh_of(scene: str) -> Mesh:
    """Small mesh of a scene."""
    if scene.startswith("bar"):
        return bar(7, 3, 3)
    return cloth(7, 6, wave=0.1 if scene == "bend_curved" else 0.0)


def element_count(mesh: Mesh, group: str) -> int:
    """Elements of a group on a mesh."""
    return len(EFFECTS.load(group).element_vertices(mesh))


def make_results(results: Invented) -> None:
    """Write the results of a study."""
    rng = np.random.default_rng(7)
    for scene, config in results.study.scenes.items():
        mesh = mesh_of(scene)
        save_mesh(mesh, results.path(MESH, scene))
        positions = _trajectory(mesh)
        with write_hdf5(results.path(TRAIN, scene)) as file:
            file["positions"] = positions
        for group in config.reduce:
            rank = 0 if scene in FLAT else 14
            bases = _write_bases(results, scene, group, element_count(mesh, group), rank, rng)
            for method, spec in results.study.methods.items():
                path = results.path(SAMPLING, scene, group, method)
                _write_sampling(path, bases, group, spec.rows)
                _write_reruns(results, scene, group, method, positions, rank, rng)
    scenes = {name: tuple(config.reduce) for name, config in results.study.scenes.items()}
    _write_tables(results, scenes, list(results.study.methods), rng)


def _trajectory(mesh: Mesh) -> np.ndarray:
    """The mesh bends more and more and sinks to the floor."""
    t = np.linspace(0.0, 1.0, FRAMES + 1)[:, None]
    q = np.repeat(mesh.points[None], FRAMES + 1, axis=0)
    q[:, :, 2] += 0.4 * t * np.sin(4.0 * mesh.points[:, 0])
    q[:, :, 1] -= 1.5 * t**2
    return q


def _write_bases(results, scene, group, count, rank, rng) -> np.ndarray:
    rows = EFFECTS.load(group).rows_per_element
    V = np.linalg.qr(rng.standard_normal((3 * rows * count, 14)))[0][:, :rank]
    for path in {results.path(BASIS, scene, group, method) for method in results.study.methods}:
        with write_hdf5(path) as file:
            file["V"], file["mean"] = V, np.zeros(len(V))
            file["singular_values"] = 0.5 ** np.arange(14)
            file.attrs.update(rank=rank, roundoff=1e-12, rows_per_element=rows)
    with write_hdf5(results.path(SNAPSHOTS, scene, group)) as file:
        for split in ("train", "test", "heldout"):
            file[split] = rng.standard_normal((10, rows * count, 3))
            file[f"{split}_frames"] = np.arange(0, FRAMES, 2) + (split != "train")
        file["row_mass"] = np.ones(rows * count)
        file.attrs.update(rows_per_element=rows, elements=count, roundoff=1e-12)
    return V


def _write_sampling(path: str, V: np.ndarray, group: str, rows: str) -> None:
    size = 3 * EFFECTS.load(group).rows_per_element
    with write_hdf5(path) as file:
        for r in range(1, V.shape[1] + 1):
            if rows == "scalar":
                entries = deim_entries(V[:, :r])
            elif rows == "joint":
                entries = 3 * np.arange(r)
            else:
                elements = block_elements(V[:, :r], size)
                entries = (size * elements[:, None] + np.arange(size)).ravel()
            store = file.create_group(f"r{r:04d}")
            store["entries"] = entries
            store["elements"] = np.unique(entries // size)


def _write_reruns(results, scene, group, method, positions, rank, rng) -> None:
    with write_hdf5(results.path(RERUNS, scene, group, method)) as file:
        file["displacement"] = np.ones(FRAMES)
        for r in (6, 10, 14, 20):
            store = file.create_group(f"r{r:04d}")
            store.attrs.update(r=r, full=r == rank, marked=r > rank)
            if r > rank:
                continue
            failed = (scene, method, r) == BLOWN_UP
            last = BLOWUP_FRAME if failed else FRAMES
            moved = positions[: last + 1] + 0.02 / r * rng.standard_normal(positions[0].shape)
            if failed:
                moved[-1] = np.nan
            store["positions"] = moved.astype(np.float32)
            store["error"] = np.geomspace(1e-4, 1e-1, last) / r
            store["extent"] = np.ones(last)
            blowup = BLOWUP_FRAME if failed else -1
            store.attrs.update(finite=not failed, blowup_frame=blowup, max_extent=1.1)


def _outcome(scene: str, method: str, r: int) -> tuple[float, float, float]:
    """Frame of a blow-up, error of the run, error within the horizon."""
    if (scene, method) == BLOWN_UP[:2]:
        return BLOWUP_FRAME, np.nan, np.nan
    error = 1e-3 if method == "pod" else 1e-2 * r
    return np.nan, error, error


def _write_tables(results, scenes, methods, rng) -> None:
    pairs = [(scene, group) for scene, groups in scenes.items() for group in groups]
    values, errors = [], []
    for scene, group in pairs:
        flat = scene in FLAT
        for k in range(1, 15):
            relative = 0.05 ** (k - 1)
            values.append((scene, group, k, 3 * relative, relative, not flat and relative > 1e-13))
        for method in methods:
            for r in (1, 2, 4, 8, 14):
                for split in ("train", "test", "heldout"):
                    error = np.nan if flat else 1e5 / 10.0**r
                    gain = 1.0 if method == "pod" else 3.0 * r
                    errors.append((scene, group, method, r, split, error, gain, r))
    times = [
        (scene, implementation, 42, local, 0.1, 1.0, local / (local + 1.1))
        for scene in scenes
        for implementation, local in (("compiled", 0.6), ("numpy", 4.0), ("interpreted", 90.0))
    ]
    costs = [
        (scene, method, "full", np.nan, r, 10, 1.0 / r, 0.2 * r, r == 14)
        for scene in scenes
        for method in methods
        for r in (6, 14)
    ]
    costs += [(scene, "full", "full", np.nan, np.nan, 10, 0.0, 4.0, True) for scene in scenes]
    for k, time in ((2, 1.0), (5, 2.0), (10, 4.0), (40, 16.0)):
        costs += [
            (scene, "fom", "full", np.nan, np.nan, k, 1.0 / k**2, time, True) for scene in scenes
        ]
        costs += [
            (scene, "fom-anderson", "full", np.nan, np.nan, k, 1.0 / k**3, 1.1 * time, True)
            for scene in scenes
            if k > 2
        ]
        if k < 10:
            early = ("fewer-iterations", "full", np.nan, np.nan, k, 0.5 / k, time, k == 2)
            costs += [(scene, *early) for scene in scenes]
    ratios = [
        (scene, group, method, factor, 400 * factor**2, r, *_ratio(method, r))
        for scene, group in pairs
        for method in methods
        for factor in (1, 2, 5)
        for r in (6, 14, 40)
    ]
    effects = [
        (scene, effect, "", time, time / 4.0, *6 * [None])
        for scene, groups in scenes.items()
        for effect, time in (
            *((group, 2.0 / len(groups)) for group in groups), ("gravity", 0.5), ("pins", 0.5),
            ("global solve", 0.7), ("rest of the frame", 0.3),
        )
    ]  # fmt: skip
    effects += [
        (scene, name, "several", 4.0 - time, None, number, time, *4 * [None])
        for scene, groups in scenes.items()
        if len(groups) > 1
        for name, number, time in (("gravity", 3, 3.5), ("a + b", 1, 2.0), ("nothing", 3, 4.0))
    ]
    rungs = [("up", "published code"), ("up", "+ affine"), ("down", "- QR"), ("signs", "signs 1")]
    others = [
        (scene, 400, stiffness, motion, method, n, 0.1 * n, None if n > 4 else 0.1 / n, 0.3 / n)
        for scene in scenes
        for stiffness in (1.0, 100.0)
        for motion in ("heldout", "kick")
        for method in ("converged", "projective", "newton", "ecsw")
        for n in (1, 2, 5)
    ]
    ladder = [
        (
            scene,
            direction,
            rung,
            10.0**i if i < 2 else np.inf,
            0.1 * i if i else np.nan,
            *((0.05, np.inf, 1.0, 50.0) if i < 2 else 4 * (np.nan,)),
        )
        for scene in scenes
        for i, (direction, rung) in enumerate(rungs)
    ]
    outcome = {6: "wrong", 14: "accurate", 20: "not run"}
    runs = [
        (scene, group, method, "full", np.nan, r, "rerun", outcome[r], np.nan, 0.016, 1.0)
        for scene, group in pairs
        for method in methods
        for r in outcome
        if scene not in FLAT
    ]
    runs += [
        (scene, "all", "full", "pod", 10, 99, "rerun", "left the scene", np.nan, 0.016, 1.0)
        for scene in scenes
    ]
    failed = {0.016: "accurate", 0.2: "blow-up"}
    runs += [
        (scene, group, method, "full", np.nan, 6, "sweep", failed[h],
         np.nan if h < 0.1 else BLOWUP_FRAME, h, ratio)
        for scene, group in pairs
        for method in methods
        for h, ratio in ((0.016, 1.0), (0.2, 1.0), (0.016, 100.0))
    ]  # fmt: skip
    reruns = [
        (scene, group, method, r, "full", 1.0, *_outcome(scene, method, r), 0.2 * r, None, "train")
        for scene, group in pairs
        if scene not in FLAT
        for method in methods
        for r in (8, 14)
    ]
    repetitions = [
        (scene, group, method, r, "training", 0.01, 0.1, np.inf, 1.0, 2.0, 3.0)
        for scene, group, method, r, *_ in reruns
    ]
    noise = [
        (scene, "bending", axes, method, r, 9, None if axes in fails else 1e-12)
        for scene in FLAT
        for axes, fails in (("all", ()), ("plane", ("plane",)), ("vertex", ()))
        for method in ("deim-joint", "published")
        for r in (6, 10)
    ]
    effects += [
        (scene, effect, role, *4 * [None], 1.0, drift, 1e-6, drift and drift > 1e-6)
        for scene, groups in scenes.items()
        for effect, role, drift in (
            *((group, "constraint group", None) for group in groups[:1]),
            *((group, "constraint group", 1e-9) for group in groups[1:]),
            ("gravity", "force", 0.5),
            ("kick", "start", 1e-15),
        )
    ]  # fmt: skip
    requests = [
        (scene, tolerance, met, reduced, 0.5 * tolerance if met else 2.0, time)
        for scene in scenes
        for tolerance in (0.1, 0.01)
        for met, reduced, time in ((True, True, 0.1), (True, False, 1.5), (False, False, 2.2))
    ]
    made = {
        "requested_tolerances": (requests, "scene tolerance met reduced error over_own"),
        "singular_values": (values, "scene group component singular_value relative above_roundoff"),
        "reconstruction_error": (errors, "scene group method r split relative_error gain"
         " elements_sampled"),
        "local_share": (times, "scene implementation vertices local_ms assembly_ms global_ms"
         " local_share"),
        "accuracy_cost": (costs, "scene method position_basis k r iterations"
         " relative_error_within_horizon ms_per_frame pareto"),
        "ladder": (ladder, "scene direction rung gain relative_error_within_horizon error_low"
         " error_high gain_low gain_high"),
        "repetitions": (repetitions, "scene group method r varied error_low error_median"
         " error_high gain_low gain_median gain_high"),
        "stability": (runs, "scene group method position_basis k r experiment outcome"
         " blowup_frame h stiffness_ratio"),
        "breakeven": (ratios, "scene group method factor vertices r ratio breakeven_r"),
        "effects_cost": (effects, "scene effect role ms_per_frame share groups without_ms force"
         " moved sensitivity_floor above_floor"),
        "reduced_reruns": (reruns, "scene group method r position_basis max_extent blowup_frame"
         " relative_error relative_error_within_horizon ms_per_frame k motion"),
        "noise": (noise, "scene group noisy_axes method r rank relative_error"),
        "alternatives": (others, "scene vertices stiffness motion method substeps"
         " ms_per_frame"
         " error_implicit error_continuous"),
    }  # fmt: skip
    for name, (rows, header) in made.items():
        _write(results.table(name), header, rows)
    _write_scaling(results, scenes)
    for scene in FLAT:
        if scene in scenes:
            _write_noise_runs(results, scene)
    for scene in scenes:
        _write_sensitivity(results, scene)
        _write_contributions(results, scene)


def _write(path: str, columns: str, rows: list[tuple]) -> pd.DataFrame:
    table = pd.DataFrame(rows, columns=columns.split())
    write_table(table, path)
    return table


def _write_noise_runs(results, scene) -> None:
    """Runs that do not start where round-off stays in the plane, else the sheet at rest."""
    points = mesh_of(scene).points
    with write_hdf5(results.path(NOISE_RUNS, scene, "bending")) as file:
        for axes, frames in (("all", FRAMES), ("plane", 0), ("vertex", FRAMES)):
            for r in (6, 10):
                store = file.create_group(f"{axes}/deim-joint/r{r:04d}")
                store["positions"] = np.repeat(points[None], frames + 1, axis=0)
                store.attrs.update(r=r, marked=r > 9, blowup_frame=-1 if frames else 0)
                store.attrs["max_extent"] = 1.0


def _write_contributions(results, scene) -> None:
    """Gravity always pulls, the groups ever more; a kick acts once."""
    names = [*results.study.scenes[scene].reduce, "gravity"]
    rows = [
        (scene, effect, "force", frame, 1.0 if effect == "gravity" else float(frame), None)
        for effect in names
        for frame in range(FRAMES)
    ]
    rows.append((scene, "kick", "start", 0, 5.0, 1.0))
    _write(results.path(CONTRIBUTIONS, scene), "scene effect role frame force energy", rows)


def _write_sensitivity(results, scene) -> None:
    """Floors of springs rise tenfold every other frame, others hardly."""
    rows = [
        (scene, label, frame, 10.0 ** (-9 + (0.5 * frame if "spring" in scene else 0.05)))
        for label in ("1e-10", "1e-08", "solver")
        for frame in range(FRAMES)
    ]
    _write(results.path(SENSITIVITY, scene), "scene perturbation frame relative_difference", rows)


def _ratio(method, r):
    """Ratio and break-even size: block-deim pays always, qdeim never, the others up to 20."""
    if method == "block-deim":
        return 0.01 * r, np.nan
    return (0.2 * r, 6) if method == "qdeim" else (0.05 * r, 20)


def _write_scaling(results, scenes) -> None:
    header = "scene method vertices ms_per_iteration local_ms global_ms exponent"
    rows = [
        (scene, method, n, n * cost, 0.6 * n * cost, 0.4 * n * cost, exponent)
        for scene in scenes
        for n in (400, 1600, 10000)
        for method, cost, exponent in (
            ("fom", 1e-4, 1.0), ("block-deim", 5e-5, 1.0), ("ecsw", 1e-2 / n, 0.0)
        )
    ]  # fmt: skip
    _write(results.table("scaling"), header, rows)


@pytest.fixture(scope="session")
def study(tmp_path_factory) -> Invented:
    """An invented study with all methods."""
    return Invented(tmp_path_factory.mktemp("results"), SCENES, METHODS)


@pytest.fixture
def small_study(tmp_path) -> Callable[[Sequence[str], Sequence[str]], Invented]:
    """Maker of a study with other scenes and methods, which a test may change."""
    return partial(Invented, tmp_path)


@pytest.fixture(scope="session")
def strain_only(tmp_path_factory) -> Invented:
    """A study without most scenes and methods."""
    return Invented(tmp_path_factory.mktemp("strain"), ["strain_oop"], ["deim", "block-deim"])


@pytest.fixture(scope="session")
def round_off_only(tmp_path_factory) -> Invented:
    """A study of which the snapshots are round-off."""
    methods = ["deim", "deim-joint", "block-deim"]
    return Invented(tmp_path_factory.mktemp("flat"), ["bend_fall"], methods)


@pytest.fixture(params=list(declarations()))
def figure_name(request) -> str:
    """Every figure in turn."""
    return request.param
