"""Every figure draws invented results, marks failures, and names missing data."""

import warnings
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from builders import frame
from pdrom.core.errors import StorageError
from pdrom.core.store import checksum_path, write_hdf5
from pdrom.core.store.checksum import write_block
from pdrom.model.effects.forces import Gravity
from pdrom.model.effects.obstacle import Sphere
from study.artifact.paths import RERUNS, SUBSPACES
from study.figures import accuracy_cost as view
from study.figures import runs as pictures
from study.figures.gain import LADDER_ERRORS
from study.figures.kit.declaration import camera_of, declarations, write_figure
from study.figures.kit.labels import label_curves
from study.figures.runs import RANKS, Runs, obstacles_of
from study.pipeline.study import Study

from .conftest import BLOWN_UP, BLOWUP_FRAME, FRAMES, ROOT, mesh_of, reference

PICTURES = ("snapshots_and_modes", "deim_iterations", "cloth_all_grid", "bending_runs",
            "spring_runs", "strain_runs", "bar_runs", "teaser")  # fmt: skip
ROWS = ("local_share", "error_budget", "ladder")  # figures with named rows


def runs(study, name: str, scene: str, frames=(0.3,), ranks=RANKS, **changes) -> Figure:
    """Draw a figure of runs in one scene, with other instants or sizes."""
    read = study.read(name, scenes=(scene,), **changes)
    return Runs(**read, frames=frames, ranks=ranks).draw()


def texts(figure: Figure) -> list[str]:
    found = [t.get_text() for t in figure.findobj(lambda artist: hasattr(artist, "get_text"))]
    return [text for text in found if text]


def test_every_figure_is_written_without_warnings_and_its_panels_contain_data(
    study, figure_name, tmp_path
):
    """Positions have few digits, because the layout's solver differs in the last bits.

    Axes are laid out once, and written where they lie.
    """
    pdf, png = tmp_path / "a.pdf", tmp_path / "a.png"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = study.draw(figure_name)
        assert figure.axes
        for ax in figure.axes:
            assert ax.has_data() or ax.texts or ax.images, ax.get_title()
        if figure_name not in PICTURES:
            labels = {label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())}
            assert len(labels - {""}) >= (1 if figure_name in ROWS else 2)
        unit = {"local_share": "(%)", "accuracy_cost": "(ms)"}.get(figure_name, "")
        assert all(unit in ax.get_xlabel() for ax in figure.axes if ax.get_xlabel())
        figure.draw_without_rendering()
        for ax in figure.axes if figure.get_layout_engine() is not None else ():
            place = ax.get_position(original=True).extents
            np.testing.assert_array_equal(place, place.round(6))
        figure.set_layout_engine("none")
        write_figure(figure, figure_name, pdf, png)
    assert pdf.read_bytes().startswith(b"%PDF")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert pdf.stat().st_size < 1_500_000
    checksums = [checksum_path(pdf).name, checksum_path(png).name]
    assert sorted(path.name for path in tmp_path.iterdir()) == [*checksums, "a.pdf", "a.png"]


def test_a_missing_input_of_a_figure_is_named(study, figure_name, tmp_path):
    with pytest.raises(StorageError, match=str(tmp_path)):
        declarations()[figure_name].draw(**study.read(figure_name, tmp_path))


def test_a_failed_run_is_marked_and_never_drawn_with_nan(study):
    scene, _, _ = BLOWN_UP
    figure = study.draw("spring_runs", scenes=(scene,))
    marked = [t for t in texts(figure) if f"blew up at frame {BLOWUP_FRAME}" in t]
    assert len(marked) == 1
    hatched = [p for ax in figure.axes for p in ax.patches if p.get_hatch()]
    assert len(hatched) == 1
    # the last stored state is not finite: the previous state is drawn
    assert f"drawn: frame {BLOWUP_FRAME - 1}" in marked[0]
    # a failure after the drawn instant is not marked
    early = runs(study, "spring_runs", scene, frames=(0.1,))
    assert not any("blew up" in text for text in texts(early))


def test_a_diverged_run_lies_on_the_upper_edge_of_the_axes(study):
    """In the figure of error against constant it is at the top of the axes and counted as a run."""
    names = "scene group method r position_basis motion max_extent blowup_frame relative_error"
    runs = [
        ("spring_twist", "spring", method, r, "full", "train", 1.0, ended, error)
        for method, ended, error in (("pod", None, 1e-3), ("deim-joint", 4, None))
        for r in (8, 14)
    ]
    reruns = frame(names, *runs)
    reruns["relative_error_within_horizon"] = reruns.relative_error
    errors = reruns.assign(split="train", gain=3.0 * reruns.r, elements_sampled=reruns.r)
    repeated = reference("repetitions")[:0]
    tables = {"reruns": reruns, "errors": errors, "repetitions": repeated}
    figure = study.draw("error_against_gain", tables, methods=("deim-joint",))
    left, right = figure.axes
    (dots,) = (each for each in left.lines if len(each.get_xdata()) and each.get_marker() == "D")
    assert (dots.get_ydata() == left.get_ylim()[1]).all()
    assert dots.get_xdata().tolist() == [24.0, 42.0]
    # constants from ten to a hundred, where both runs failed
    assert [bar.get_height() for bar in right.patches] == [100.0]
    assert [text.get_text() for text in right.texts] == ["2"]
    assert [tick.get_text() for tick in right.get_xticklabels()] == ["$10^{1}$ to $10^{2}$"]


def test_failed_starts_are_counted_below_runs_with_bases_of_rounding_errors(study):
    runs = [
        ("bend_fall", "bending", axes, "deim-joint", r, 9, None if axes == "plane" else 1e-12)
        for axes in ("all", "plane", "vertex")
        for r in (6, 10)
    ]
    noise = frame("scene group noisy_axes method r rank relative_error", *runs)
    figure = study.draw(
        "bending_runs", {"noise": noise}, scenes=("bend_fall",), methods=("deim-joint",)
    )
    shown = texts(figure)
    assert sum("0 of 1 starts fail" in text for text in shown) == 1
    assert sum("1 of 1 starts fail" in text for text in shown) == 1
    labels = [" ".join(text.split()) for text in shown if "noise" in text]
    assert ["all axes, plane and one vertex" in label for label in labels] == [True, False]
    assert any("blew up at frame 0" in text for text in shown)


def test_a_run_out_of_view_is_drawn_to_a_stated_scale(small_study):
    study = small_study(["spring_twist"], ["deim-joint"])
    path = study.path(RERUNS, "spring_twist", "spring", "deim-joint")
    with h5py.File(path, "a") as file:
        file["r0006/positions"][...] *= 8.0
    write_block(Path(path))
    figure = runs(study, "spring_runs", "spring_twist", ranks=(6, 14))
    assert sum("scale 1 :" in text for text in texts(figure)) == 1


def test_rounding_errors_are_drawn_and_panels_of_missing_scenes_or_methods_omitted(
    round_off_only, strain_only, figure_name
):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert texts(round_off_only.draw(figure_name, scenes=("bend_fall",)))
    figure = strain_only.draw(figure_name)
    assert not any("spring" in ax.get_title() for ax in figure.axes)
    noted = any("no data in this configuration" in text for text in texts(figure))
    others = ("bar_runs", "spring_runs", "bending_runs", "cloth_all_grid", "error_against_gain")
    assert noted == (figure_name in others)


def test_figures_are_upright_and_have_the_obstacles_that_the_scene_lists(study):
    """Only a floor has a shadow; a scene without a floor has none."""
    read = study.read("bar_runs", scenes=("bar_release",))
    (each,), full = read["drawn"].experiments, mesh_of("bar_release").points[None]
    gravity = Gravity.Config(acceleration=(0.0, 0.0, -9.81))
    ball = Sphere.Config(centre=(0.0, 0.0, -0.3), radius=0.2)
    turned = each.model_copy(update={"effects": (gravity, ball)})
    assert camera_of(each).up == (0.0, 1.0, 0.0)
    assert camera_of(turned).up == (0.0, 0.0, 1.0)
    assert obstacles_of(each, full) is None
    assert [len(b.points) > 4 for b in obstacles_of(turned, full)] == [True]
    assert obstacles_of(each.model_copy(update={"effects": (gravity,)}), full) == []


@pytest.mark.parametrize(
    ("k", "ran", "shown"),
    [(20, FRAMES, "error 25 %, 0.5 ms"), (9, FRAMES, "k = 9"), (20, 2, "blew up")],
)
def test_the_first_figure_shows_a_test_trajectory_and_a_subspace_run_until_it_ended(
    small_study, monkeypatch, k, ran, shown
):
    """Reduced projections end at the frame of the reference instead of being drawn smaller."""
    monkeypatch.setattr(pictures, "TEST_FRAMES", 2)
    study = small_study(["bar_release"], ["gappy"])
    path = study.path(RERUNS, "bar_release", "deformation_gradient", "gappy")
    with h5py.File(path, "a") as file:
        file["heldout/r0014/positions"][...] *= 8.0
    write_block(Path(path))
    names = "scene group method position_basis motion k r relative_error_within_horizon"
    rows = [
        ("bar_release", "all", "ecsw-1e-02", "pod", "heldout", k, 99, None if ran < 9 else 0.25)
    ]
    rows += [("bar_release", "deformation_gradient", "gappy", "full", "heldout", None, 14, 3.5)]
    table = frame(names, *rows).assign(ms_per_frame=0.5, speedup=4.0)
    points = mesh_of("bar_release").points
    study.study = Study(study.settings | {"subspace": {}}, ROOT)
    with write_hdf5(study.path(SUBSPACES, "bar_release")) as file:
        file[f"columns/pod_k{k:03d}/B"] = np.eye(len(points))
        model = file.create_group(f"models/pod_k{k:03d}_ecsw-1e-02")
        model["heldout/coordinates"] = np.repeat(points[None], ran + 1, axis=0)
    found = texts(study.draw("teaser", {"table": table}, methods=("gappy",)))
    assert any(shown in text for text in found)
    assert {"2 ms", "error 350 %, 0.5 ms", "three elements per mode"} <= {*found}
    assert any("test 1\nframe 12\nr = 14" in text for text in found)
    assert not any("scale 1 :" in text for text in found)


def test_singular_values_below_rounding_errors_have_hollow_marks(study):
    scenes, table = ("bend_fall", "spring_stretch"), reference("singular_values")
    figure = study.draw("singular_values", scenes=scenes)
    for ax, scene in zip(figure.axes, scenes, strict=True):
        hollow = (~table[table.scene == scene].above_roundoff).sum()
        assert hollow > 0
        lines = [line for line in ax.lines if line.get_markerfacecolor() == "white"]
        assert sum(len(line.get_xdata()) for line in lines) == hollow


def test_errors_above_the_axis_are_marked_on_its_edge(study):
    errors = [("strain_twist", "strain", "deim", r, "train", 1e5 / 10.0**r) for r in (1, 2, 4)]
    table = frame("scene group method r split relative_error", *errors)
    figure = study.draw("reconstruction_error", {"table": table}, scenes=("strain_twist",))
    (ax,) = figure.axes
    arrows = [line for line in ax.lines if line.get_marker() == 6]
    assert [list(line.get_xdata()) for line in arrows] == [[1.0]]
    assert max(line.get_ydata().max() for line in ax.lines) <= ax.get_ylim()[1]


def test_the_horizon_is_the_first_frame_above_the_threshold(study):
    figure = study.draw("sensitivity_floor", scenes=("spring_twist", "strain_oop"))
    # 10^(-9 + f/2) exceeds 1e-3 first at f = 13
    assert "twisted sheet, springs: horizon 13" in texts(figure)
    assert "hanging sheet, strain: predictable" in texts(figure)
    solid, dotted = figure.axes[0].lines[1:3]
    assert [len(solid.get_xdata()), dotted.get_xdata()[0]] == [14, 13]


def test_error_against_time_has_a_labelled_curve_for_each_kind_of_model(study):
    """For coarser meshes and subspaces the best settings are drawn; other models are left out."""
    names = "scene method position_basis relative_error_within_horizon ms_per_frame"
    points = [("full", "full", 0.01, 4.0), ("fom-anderson", "full", 0.005, 4.5)]
    points += [("fom", "full", 1.0 / k, 0.4 * k) for k in (10, 2, 40)]
    points += [("coarser-mesh", "full", 0.04, 0.1), ("coarser-mesh-anderson", "full", 0.03, 0.3)]
    points += [("coarser-mesh", "full", 0.5, 0.2), ("ecsw-1e-02", "pod", 1e5, 0.2)]
    points += [("gappy", "full", np.inf, 1.0), ("gappy", "full", 0.2, 2.0), ("deim", "full", 1, 1)]
    table = frame(names, *(("strain_oop", *point) for point in points))
    table["mesh_error"] = np.where(table.method == "full", 0.02, np.nan)
    figure = study.draw("accuracy_cost", {"table": table}, scenes=("strain_oop",))
    (ax,) = figure.axes
    labels = [text.get_text() for text in ax.texts]
    assert labels == [view.CURVES[name] for name in ("fom", "coarser-mesh", "ecsw", "gappy")]
    *curves, mesh = [line.get_xydata().tolist() for line in ax.lines]
    assert curves[0] == pytest.approx(np.array([[0.8, 0.5], [4.0, 0.1], [16.0, 0.025]]))
    assert curves[1:] == [[[0.1, 0.04], [0.3, 0.03]], [[0.2, view.HIGH]], [[2.0, 0.2]]]
    assert [y for _, y in mesh] == [0.02, 0.02]


def test_labels_stand_next_to_a_point_of_their_curve():
    ax = Figure().subplots()
    ax.set(xlim=(0, 1), ylim=(0, 1))
    up, down = np.array([[0.1, 0.1], [0.8, 0.8]]), np.array([[0.1, 0.9], [0.8, 0.2]])
    label_curves(ax, [("up", "k", up), ("", "k", up), ("down", "k", down)], (4.0, 3.0))
    first, second = ax.texts
    assert [[*first.xy] in up.tolist(), [*second.xy] in down.tolist()] == [True, True]
    assert (0.0, 0.0) not in {tuple(first.xyann), tuple(second.xyann)}


def test_the_ablation_has_a_line_for_each_scene_and_constants_of_two(study):
    """A study with other ablation steps has those of its list; a diverged run is at the limit."""
    names = "scene direction rung gain relative_error_within_horizon error_low error_high"
    rows = [("spring_twist", "up", "published code", 1234.0, None, None, None)]
    rows += [("spring_twist", "down", "and a gain of at most 2", 2.0, 0.01, 0.005, 0.02)]
    rows += [("spring_twist", "up", "my step", 50.0, 0.5, None, None)]
    for table, steps in ((frame(names, *rows), 2), (frame(names, rows[2]), 1)):
        (ax,) = study.draw("ladder", {"table": table}, scenes=("spring_twist",)).axes
        assert len(ax.lines[0].get_xdata()) == steps
    (ax,) = study.draw("ladder", {"table": frame(names, *rows)}, scenes=("spring_twist",)).axes
    assert ax.lines[0].get_xdata().tolist() == [LADDER_ERRORS[1], 0.01]
    assert [text.get_text() for text in ax.texts] == ["1,234", "2.0", "DEIM constants"]


def test_the_error_budget_has_medians_of_test_trajectories(study):
    names = "scene motion skinning part deformation_error"
    rows = [
        ("strain_oop", motion, 0, part, scale * error)
        for motion, scale in (("heldout", 1.0), ("kick", 2.0), ("stiffness", 9.0))
        for part, error in (("span", 1e-9), ("closure", 0.1), ("full_order", 0.2))
    ]
    table = frame(names, *rows, ("strain_oop", "kick", 40, "run", 1.0))
    (ax,) = study.draw("error_budget", {"table": table}, scenes=("strain_oop",)).axes
    found = {line.get_marker(): line.get_xdata()[0] for line in ax.lines[1:]}
    assert found == pytest.approx({"None": 1e-3, "|": 1e-3, "o": 0.2, "x": 0.4})


def test_coarser_meshes_have_a_curve_and_the_mesh_of_the_scene_an_error():
    """Validation trajectories are not drawn."""
    names = "method vertices mesh_error motion error_implicit time_ratio"
    own = [("converged", 400, 0.05, "heldout", 0, None), ("anderson", 400, None, "heldout", 0.2, 1)]
    other = [("coarser-mesh", 9, None, *rest) for rest in (("heldout", 0.3, 0.1), ("v", 0.1, 0.1))]
    table = frame(names, *own, *other).assign(scene="a", factor=1)
    table = table.assign(stiffness=1.0, training_motions=None, vertices_ratio=0.0, recorded=None)
    (ax,) = declarations()["alternatives"].draw(table=table).axes
    assert ax.get_title() == "a,\n400 vertices"
    curves = {line.get_color(): line.get_xydata().tolist() for line in ax.lines}
    assert [curves[colour] for colour in view.BEST.values()] == [[[1.0, 0.2]], [[0.1, 0.3]]]
    assert curves[view.MESH_ERROR["color"]] == [[0.0, 0.05], [1.0, 0.05]]


def test_a_doubtful_speedup_has_another_mark(study):
    """Marks: hollow for a large error, an arrow for a lower bound, a cross if not judged.

    Of the reduced models the one with five iterations and most training trajectories is drawn.
    """
    names = "vertices motion position_error known same_reached"
    rows = [(8000, "heldout", 0.0035, True, True), (400, "heldout", 9.0, False, True)]
    rows += [(400, "kick", 0.2, True, True), (400, "stiffness", 0.011, True, False)]
    table = frame(names, *rows).assign(elements="springs", scene="a", factor=1, stiffness=1.0)
    table = table.assign(method="ecsw", training_motions=2, iterations=5, coarser_reached=True)
    of = [f"{name}_speedup" for name in ("same", "coarser")]
    table[[*of, *(f"{name}_{end}" for name in of for end in ("low", "high"))]] = 4.0
    table = pd.concat([table, table.assign(training_motions=1), table.assign(iterations=np.nan)])
    same, coarser = declarations()["equal_error"].draw(table=table.assign(recorded=None)).axes
    marks = [line for line in same.lines if len(line.get_xdata()) == 1]
    found = [(line.get_marker(), line.get_mfc() == "white") for line in marks]
    assert found == [("x", False), ("^", True), ("^", False), (6, False), ("^", False)]
    assert all(a.get_xdata()[0] <= b.get_xdata()[0] for a, b in pairwise(marks))
    assert [len(axes.lines) - len(marks) for axes in (same, coarser)] == [4, 3]
    assert [text.get_text() for text in same.texts] == ["a: 0.35 %"]
