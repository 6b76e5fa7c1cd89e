"""Tables of the study from small files, against values worked out by hand."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from builders import perturbed_runs
from pdrom.core.store import write_hdf5, write_table
from pdrom.model.held_out import MOTIONS, PLAYBACK
from pdrom.reduction.basis import Basis, save_basis
from study.artifact import paths
from study.artifact.paths import File
from study.experiments.kit.base import Horizon
from study.tables.accuracy_cost import accuracy_cost
from study.tables.effects_cost import local_share
from study.tables.errors import sensitivity, singular_values
from study.tables.kit.results import TRAIN, trained
from study.tables.reduced_reruns import reduced_reruns


def basis_file(path, sigma, rank) -> File:
    axes = (True,) * 3
    basis = Basis(np.zeros((6, rank)), np.zeros(6), np.array(sigma), rank, 1e-9, 1, axes)
    path.parent.mkdir(parents=True, exist_ok=True)
    save_basis(basis, path)
    return paths.BASIS.file(str(path))


def test_singular_values_have_their_share_and_the_level_of_rounding_errors(tmp_path):
    bases = [
        basis_file(tmp_path / "pod" / "b_scene" / "spring" / "x.h5", [4.0, 1.0, 1e-12], 2),
        basis_file(tmp_path / "pod" / "a_scene" / "bending" / "x.h5", [0.0, 0.0], 0),
    ]
    table = singular_values(bases)
    assert table.scene.tolist() == ["b_scene"] * 3 + ["a_scene"] * 2
    assert table.group.tolist() == ["spring"] * 3 + ["bending"] * 2
    assert table.component.tolist() == [1, 2, 3, 1, 2]
    assert table.relative[:3].tolist() == [1.0, 0.25, 2.5e-13]
    assert table.relative[3:].isna().all()
    assert table.above_roundoff.tolist() == [True, True, False, False, False]


NOT_TIMED = pd.DataFrame(columns=["scene", "ms_per_frame"])  # table frame_times without rows
DISPLACEMENT = np.array([1.0, 2.0, 3.0, 4.0])
ENERGY = [1.0, 0.9]
STEP = DISPLACEMENT / 2.0  # of the velocities; their differences are thrice those of the positions
UNITS = {"rest_norm": 1.0, "time_step": 0.1}
SERIES = {
    "displacement": DISPLACEMENT, "step": STEP, "energy": ENERGY,
    "deformed": DISPLACEMENT / 5.0, "displacement_converged": 2.0 * DISPLACEMENT,
    "deformed_converged": DISPLACEMENT / 5.0,
}  # fmt: skip


def write_both(path, rows: list[dict]) -> None:
    """Write the rows of runs of the training trajectory, and the same rows of a test trajectory."""
    write_table(pd.DataFrame(rows), f"{path}.csv")
    write_table(pd.DataFrame(rows).assign(motion="heldout"), f"{path}_heldout.csv")


def store_series(run, difference):
    """Series of a run with these differences."""
    for name, position, shape in (("", 1.0, 0.1), ("_converged", 4.0, 0.2)):
        run[f"difference{name}"] = np.multiply(difference, position)
        run[f"shape_difference{name}"] = np.multiply(difference, shape)
    run["step_difference"] = np.multiply(difference, 3.0)
    run["energy"] = [1.0, 0.7]


@pytest.fixture
def files(tmp_path) -> dict[str, object]:
    """Inputs of `reduced_reruns`: reruns of scene a and b, subspace runs of b, and their timings.

    Scene a leaves the threshold in frame 2 (test trajectory: 1), scene b never does.
    """
    reruns = []
    cases = {
        # differences of each run by frame; short runs diverged
        "a": {6: [0.1, 0.2, 9.0, 9.0], 10: [0.5], 20: None},
        "b": {6: [0.1, 0.1, 0.1, 0.1], 10: [0.2, 0.2]},
    }
    for scene, runs in cases.items():
        folder = tmp_path / "reruns" / scene / "spring"
        folder.mkdir(parents=True)
        rows = []
        with write_hdf5(folder / "deim.h5") as file:
            file.attrs.update(extent_norm=2.0, **UNITS)
            for store in (file, *map(file.create_group, MOTIONS)):
                for series, values in SERIES.items():
                    store[series] = values
                for r, difference in runs.items():
                    run = store.create_group(f"r{r:04d}")
                    if difference is not None:
                        store_series(run, difference)
        for r, difference in runs.items():
            row = {"scene": scene, "group": "spring", "method": "deim", "r": r, "frames": 0}
            if difference is not None:
                whole = len(difference) == 4
                row |= {
                    "frames": len(difference), "finite": whole, "max_extent": 1.5,
                    "blowup_frame": None if whole else len(difference),
                    "relative_error": 0.5 if whole else None,
                }  # fmt: skip
            rows.append(row)
        write_both(folder / "deim", rows)
        reruns.append(str(folder / "deim"))
    folder = tmp_path / "subspaces" / "b"
    folder.mkdir(parents=True)
    models = {("pod", 8, "full"): [0.4] * 4, ("pod", 8, "ecsw-1e-02"): [0.8] * 4}
    with write_hdf5(folder / "models.h5") as file:
        file.attrs.update(extent_norm=4.0, **UNITS)
        for motion, (series, values) in product(("train", *MOTIONS), SERIES.items()):
            file[f"{series}/{motion}"] = values
        for (base, k, method), difference in models.items():
            for motion in ("train", "heldout"):
                run = file.create_group(f"models/{base}_k{k:03d}_{method}/{motion}")
                store_series(run, difference)
    rows = [
        {"scene": "b", "group": "all", "method": m, "position_basis": p, "k": k, "r": 33,
         "frames": 4, "finite": True, "max_extent": 1.0, "training_residual": 0.01,
         "relative_error": 0.1}
        for p, k, m in models
    ]  # fmt: skip
    write_both(folder / "models", rows)
    subspaces = [str(folder / "models")]

    def time(scene, implementation="compiled", ms=8.0, **labels):
        return {
            "scene": scene, "implementation": implementation, "ms_per_frame": ms,
            "local_ms": ms / 4, "assembly_ms": ms / 8, "lift_ms": ms / 8, "global_ms": ms / 4,
            "vertices_ms": ms / 8, "vertices": 9, "iterations": 10, **labels,
        }  # fmt: skip

    local = {"group": "spring", "method": "deim"}
    timings = pd.DataFrame([
        time("a"), time("a", "numpy", 80.0),
        time("a", "interpreted", 900.0), time("a", ms=4.0, r=6, **local),
        time("a", ms=5.0, r=10, **local), time("a", ms=2.5, method="fom", iterations=2),
        time("a", ms=24.0, method="fom", iterations=40),
        time("a", ms=9.0, method="fom-anderson", iterations=10),
        time("a", ms=2.0, method="coarser-mesh", iterations=10, vertices=4),
        time("a", ms=3.0, method="coarser-mesh-anderson", iterations=10, vertices=4),
        time("b", ms=10.0), time("b", ms=2.0, r=6, **local),
        time("b", ms=1.0, group="all", method="full", position_basis="pod", k=8),
        time("b", ms=0.5, group="all", method="ecsw-1e-02", position_basis="pod", k=8),
    ])  # fmt: skip
    references = [
        {"scene": scene, "motion": motion, "frames": 4, "horizon_frame": 4, "playback_all": 0.5,
         "playback_error": 0.5 if motion == "heldout" else None, "playback_deformation_error": 0.4,
         "replay_error": 0.3, "replay_deformation_error": 0.2,
         "reference_error": 0.01 if scene == "a" else 0.02, "reference_deformation_error": 0.03}
        for scene, motion in product("ab", (TRAIN, *MOTIONS))
    ]  # fmt: skip
    places = {
        "runs": (paths.RERUNS, reruns, ".h5"), "rows": (paths.RERUNS_TRAIN, reruns, ".csv"),
        "rows_heldout": (paths.RERUNS_HELDOUT, reruns, "_heldout.csv"),
        "subspaces": (paths.SUBSPACES, subspaces, ".h5"),
        "subspace_rows": (paths.SUBSPACES_TRAIN, subspaces, ".csv"),
        "subspace_rows_heldout": (paths.SUBSPACES_HELDOUT, subspaces, "_heldout.csv"),
    }  # fmt: skip
    return {
        **{n: [p.file(f"{path}{end}") for path in own] for n, (p, own, end) in places.items()},
        "references": pd.DataFrame(references),
        "timings": timings,
        "frame_times": NOT_TIMED,
        "sensitivity": sensitivity(perturbed_runs()),
        "horizon": Horizon(perturbation=1e-10, threshold=1e-3),
    }


def test_errors_of_positions_shapes_and_velocities_cover_the_frames_before_the_horizon(files):
    """Root mean squares before the horizon, which is 2 for scene a, over the norm of the extent."""
    table = trained(reduced_reruns(**files))
    assert table.error_over_extent[0] == pytest.approx(np.sqrt(0.025) / 2.0)
    assert table.error_over_extent[[3, 5]].tolist() == pytest.approx([0.05, 0.1])
    assert table.error_over_extent[[1, 2, 4]].isna().all()
    np.testing.assert_allclose(table.shape_error, table.error_over_extent / 10.0)
    # also over the frames before the horizon: three times the difference over half the norm
    np.testing.assert_allclose(table.velocity_error, 6.0 * table.relative_error_within_horizon)
    others = ["deformation_error", "error_converged", "deformation_converged"]
    within = table.relative_error_within_horizon.to_numpy()[:, None]
    np.testing.assert_allclose(table[others], within * [0.5, 2.0, 1.0])
    assert table.reference_error.tolist() == [0.01] * 3 + [0.02] * 4
    # scene a ends before the second sample of the energy
    assert table.energy_drift.isna().tolist() == [True, True, True, False, True, False, False]
    assert table.energy_drift[[3, 5, 6]].tolist() == pytest.approx([0.2] * 3)


def error(difference, end) -> float:
    return np.linalg.norm(difference[:end]) / np.linalg.norm(DISPLACEMENT[:end])


def test_reruns_have_their_errors_within_the_horizon_and_their_times(files):
    table = trained(reduced_reruns(**files))
    within = table.relative_error_within_horizon
    assert table.scene.tolist() == ["a", "a", "a", "b", "b", "b", "b"]
    assert within[0] == pytest.approx(error([0.1, 0.2], 2))
    assert within[[1, 2, 4]].isna().all()
    for row, whole in ((3, 0.1), (5, 0.4), (6, 0.8)):
        assert within[row] == pytest.approx(error([whole] * 4, 4))
    assert table.horizon_frame.tolist() == [2, 2, 2, 4, 4, 4, 4]
    assert table.sensitivity_floor[[0, 3]].tolist() == [2e-9, 3e-12]
    assert table.k.isna().tolist() == [True] * 5 + [False] * 2
    none = {key: [] for key in ("subspaces", "subspace_rows", "subspace_rows_heldout")}
    pd.testing.assert_frame_equal(trained(reduced_reruns(**files | none)), table[:5])
    assert table.blowup_frame.isna().tolist() == [True, False, True, True, False, True, True]
    assert table.finite.isna().tolist() == [False, False, True, False, False, False, False]
    # times go to their runs
    expected = [4.0, 5.0, np.nan, 2.0, np.nan, 1.0, 0.5]
    np.testing.assert_array_equal(table.ms_per_frame, expected)
    np.testing.assert_allclose(table.speedup, [2.0, 1.6, np.nan, 5.0, np.nan, 10.0, 20.0])
    np.testing.assert_allclose(table.local_ms, np.array(expected) / 2)
    np.testing.assert_allclose(table.global_ms, np.array(expected) / 4)
    np.testing.assert_allclose(table.vertices_ms, np.array(expected) / 8)


def test_runs_of_a_test_trajectory_are_judged_up_to_its_horizon(files):
    table = reduced_reruns(**files)
    played = table[table.method == PLAYBACK].set_index(["motion", "scene"])
    assert played.relative_error.tolist() == pytest.approx([0.5] * 6)
    assert played.playback_error["heldout"].to_dict() == pytest.approx({"a": 0.5, "b": 0.5})
    assert played.playback_error["kick"].isna().all()  # no run perturbed that trajectory
    names = ["deformation_error", "error_converged", "deformation_converged"]
    assert played.loc[("heldout", "a"), names].tolist() == [0.4, 0.3, 0.2]
    table = table[(table.motion != TRAIN) & (table.method != PLAYBACK)].reset_index(drop=True)
    assert table.playback_error.tolist() == pytest.approx([0.5] * 7)
    assert table.horizon_frame.tolist() == [1, 1, 1, 4, 4, 4, 4]
    assert set(table.motion) == {"heldout"}
    assert table.relative_error_within_horizon[0] == pytest.approx(0.1)
    assert table[["ms_per_frame", "speedup"]].isna().all(axis=None)
    # it diverged in frame 1, which is after the horizon
    assert table.relative_error_within_horizon[1] == pytest.approx(0.5)


def sweep(**changes) -> pd.DataFrame:
    """Scene a with K = 2, 10 (its default) and 40, and a coarser mesh, all or with ``changes``."""
    rows = [
        {"iterations": k, "window": w, "vertices": n, "mesh_error": m,
         "error_converged": e, "deformation_converged": 3.0 * e}
        for k, w, e, n, m in (
            (2, 0, 0.4, 9, None), (10, 0, 0.1, 9, 0.05), (40, 0, 0.02, 9, None),
            (10, 5, 0.01, 9, None), (10, 0, 0.5, 4, None), (10, 5, 0.5, 4, None),
        )
    ]  # fmt: skip
    return pd.DataFrame(rows).assign(scene="a", frames=2, **changes)


def points(files, runs, other) -> pd.DataFrame:
    """Table `accuracy_cost` of these runs, with those of ``other`` iterations."""
    return accuracy_cost(runs, files["timings"], NOT_TIMED, other, {"a": 10, "b": 20})


def test_accuracy_cost_compares_all_runs_with_the_converged_run(files):
    """The run with the scene's iterations occurs twice; acceleration beats 40 iterations."""
    table = points(files, reduced_reruns(**files), sweep())
    columns = ["scene", "method", "iterations", "vertices", "ms_per_frame", "pareto"]
    assert list(table[columns].itertuples(index=False, name=None)) == [
        ("a", "full", 10, 9, 8.0, True), ("a", "deim", 10, 9, 4.0, True),
        ("a", "fom", 2, 9, 2.5, True), ("a", "fom", 10, 9, 8.0, True),
        ("a", "fom", 40, 9, 24.0, False), ("a", "fom-anderson", 10, 9, 9.0, True),
        ("a", "coarser-mesh", 10, 4, 2.0, True), ("a", "coarser-mesh-anderson", 10, 4, 3.0, False),
        ("b", "deim", 20, 9, 2.0, True), ("b", "full", 20, 9, 1.0, True),
        ("b", "ecsw-1e-02", 20, 9, 0.5, True),
    ]  # fmt: skip
    assert table.mesh_error.fillna(0.0).tolist() == [0.05] + [0.0] * 10
    reduced = 2.0 * error([0.1, 0.2], 2)
    found = table[table.scene == "a"]
    positions, shapes = found.relative_error_within_horizon, found.deformation_error
    assert positions.tolist() == pytest.approx([0.1, reduced, 0.4, 0.1, 0.02, 0.01, 0.5, 0.5])
    assert shapes.tolist() == pytest.approx([0.3, reduced / 2.0, 1.2, 0.3, 0.06, 0.03, 1.5, 1.5])
    assert found.reference_error.tolist() == [0.01] * 8


def test_a_scene_without_a_converged_run_has_no_row(files):
    runs, none = reduced_reruns(**files), sweep(error_converged=np.nan)
    assert set(points(files, runs, none).method) == {"deim", "full", "ecsw-1e-02"}
    assert points(files, runs.assign(error_converged=None), none).empty


def test_the_local_share_includes_assembly_and_refers_to_the_complete_frame(files):
    table = local_share(files["timings"], NOT_TIMED)
    assert table.scene.tolist() == ["a", "a", "a", "b"]
    assert table.implementation.tolist() == ["interpreted", "numpy", "compiled", "compiled"]
    assert table.local_share.tolist() == pytest.approx([0.375] * 4)
