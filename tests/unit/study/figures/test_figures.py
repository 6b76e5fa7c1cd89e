"""Every figure draws from invented results; what it says about failures and missing data."""

import warnings
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
from pdrom.reduction.method import load_methods
from places import CONFIG
from study.artifact.paths import RERUNS, SUBSPACES
from study.figures import accuracy_cost as view
from study.figures.kit.declaration import Drawn, Reduction, camera_of, declarations, write_figure
from study.figures.runs import RANKS, Runs, obstacles_of
from study.pipeline.study import Study

from .conftest import BLOWN_UP, BLOWUP_FRAME, FRAMES, ROOT, mesh_of, reference

PICTURES = ("snapshots_and_modes", "deim_iterations", "cloth_all_grid", "bending_runs",
            "spring_runs", "strain_runs", "bar_runs", "teaser")  # fmt: skip


def runs(study, name: str, scene: str, frames=(0.3,), ranks=RANKS, **changes) -> Figure:
    """Draw a figure of runs in one scene, with other instants or sizes."""
    read = study.read(name, scenes=(scene,), **changes)
    return Runs(**read, frames=frames, ranks=ranks).draw()


def texts(figure: Figure) -> list[str]:
    found = [t.get_text() for t in figure.findobj(lambda artist: hasattr(artist, "get_text"))]
    return [text for text in found if text]


def test_every_figure_is_written_without_warnings_and_its_panels_hold_data(
    study, figure_name, tmp_path
):
    """Positions have few digits: the last bits of the layout's solver differ between drawings.

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
            assert len(labels - {""}) >= (1 if figure_name == "local_share" else 2)
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


def test_a_missing_file_is_named(study, figure_name, tmp_path):
    with pytest.raises(StorageError, match=str(tmp_path)):
        declarations()[figure_name].draw(**study.read(figure_name, tmp_path))


def test_a_failed_run_is_marked_and_never_drawn_with_nan(study):
    scene, _, _ = BLOWN_UP
    figure = study.draw("spring_runs", scenes=(scene,))
    marked = [t for t in texts(figure) if f"blew up at frame {BLOWUP_FRAME}" in t]
    assert len(marked) == 1
    hatched = [p for ax in figure.axes for p in ax.patches if p.get_hatch()]
    assert len(hatched) == 1
    # the last stored state is not finite: the one before it is drawn
    assert f"drawn: frame {BLOWUP_FRAME - 1}" in marked[0]
    # a failure later than the drawn instant is none
    early = runs(study, "spring_runs", scene, frames=(0.1,))
    assert not any("blew up" in text for text in texts(early))


def test_a_run_that_ended_early_lies_on_the_rim(study):
    """Error against gain: as high as the axis goes, and counted among the runs."""
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
    # gains from ten to a hundred, where all of the two runs failed
    assert [bar.get_height() for bar in right.patches] == [100.0]
    assert [text.get_text() for text in right.texts] == ["2"]
    assert [tick.get_text() for tick in right.get_xticklabels()] == ["$10^{1}$ to $10^{2}$"]


def test_starts_that_fail_are_counted_below_runs_on_bases_of_round_off(study):
    """Kinds of starts with equal counts share a row; sizes beyond the rank are left out."""
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
    assert ["all axes, one vertex across" in label for label in labels] == [True, False]
    assert any("blew up at frame 0" in text for text in shown)


def test_a_run_out_of_view_is_drawn_to_a_stated_scale(small_study):
    study = small_study(["spring_twist"], ["deim-joint"])
    path = study.path(RERUNS, "spring_twist", "spring", "deim-joint")
    with h5py.File(path, "a") as file:
        file["r0006/positions"][...] *= 8.0
    write_block(Path(path))
    figure = runs(study, "spring_runs", "spring_twist", ranks=(6, 14))
    assert sum("scale 1 :" in text for text in texts(figure)) == 1


def test_round_off_is_drawn_and_missing_scenes_and_methods_leave_their_panels_out(
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
    """A floor alone has a shadow; of a scene without one none is drawn."""
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
    [(20, FRAMES, "ecsw, k = 20"), (9, FRAMES, "ecsw, k = 9"), (20, 2, "blew up")],
)
def test_the_teaser_shows_a_sampled_subspace_as_far_as_it_ran(small_study, k, ran, shown):
    study = small_study(["bar_release"], ["pod"])
    assert not any("ecsw" in text for text in texts(study.draw("teaser", methods=("pod",))))
    points = mesh_of("bar_release").points
    study.study = Study(study.settings | {"subspace": {}}, ROOT)
    with write_hdf5(study.path(SUBSPACES, "bar_release")) as file:
        file[f"columns/pod_k{k:03d}/B"] = np.eye(len(points))
        model = file.create_group(f"models/pod_k{k:03d}_ecsw-1e-02")
        model["train/coordinates"] = np.repeat(points[None], ran + 1, axis=0)
    assert any(shown in text for text in texts(study.draw("teaser", methods=("pod",))))


def test_singular_values_below_round_off_are_hollow(study):
    scenes, table = ("bend_fall", "spring_stretch"), reference("singular_values")
    figure = study.draw("singular_values", scenes=scenes)
    for ax, scene in zip(figure.axes, scenes, strict=True):
        hollow = (~table[table.scene == scene].above_roundoff).sum()
        assert hollow > 0
        lines = [line for line in ax.lines if line.get_markerfacecolor() == "white"]
        assert sum(len(line.get_xdata()) for line in lines) == hollow


def test_errors_above_the_axis_are_marked_on_its_rim(study):
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
    assert "spring twist: 13" in texts(figure)
    assert "strain oop: beyond 20" in texts(figure)


def test_full_order_runs_with_any_number_of_iterations_are_the_crosses_of_one_curve(study):
    """The scene's own number of iterations is a line, accelerated runs are not drawn."""
    names = "scene method position_basis iterations relative_error_within_horizon ms_per_frame"
    points = [("full", 10, 0.01, 4.0), ("deim", 10, 0.5, 2.0), ("fom-anderson", 10, 0.005, 4.5)]
    points += [("fom", k, 1.0 / k, 0.4 * k) for k in (2, 10, 40)]
    points += [("coarser-mesh", 2, 0.04, 0.1), ("coarser-mesh-anderson", 5, 0.03, 0.3)]
    table = frame(names, *(("strain_oop", method, "full", *rest) for method, *rest in points))
    table["mesh_error"] = np.where(table.method == "full", 0.02, np.nan)
    figure = study.draw("accuracy_cost", {"table": table}, scenes=("strain_oop",))
    (ax,) = figure.axes
    assert any(list(line.get_xdata()) == [4.0, 4.0] for line in ax.lines)
    assert 4.5 not in {float(x) for line in ax.lines for x in line.get_xdata()}
    (runs,) = (line for line in ax.lines if line.get_marker() == "X")
    assert list(runs.get_xdata()) == pytest.approx([0.8, 4.0, 16.0])
    *_, front, _ = [line for line in ax.lines if line.get_color() == view.FAMILIES[view.COARSE]]
    assert front.get_xydata().tolist() == [[0.1, 0.04], [0.3, 0.03]]
    assert any(list(line.get_ydata()) == [0.02, 0.02] for line in ax.lines)


def test_coarser_meshes_have_a_curve_and_the_own_mesh_an_error():
    """Validation trajectories are not drawn."""
    names = "method vertices mesh_error motion error_implicit time_ratio"
    own = [("converged", 400, 0.05, "heldout", 0, None), ("anderson", 400, None, "heldout", 0.2, 1)]
    other = [("coarser-mesh", 9, None, *rest) for rest in (("heldout", 0.3, 0.1), ("v", 0.1, 0.1))]
    table = frame(names, *own, *other).assign(scene="a", factor=1)
    table = table.assign(stiffness=1.0, training_motions=None, vertices_ratio=0.0, recorded=None)
    (ax,) = declarations()["alternatives"].draw(table=table).axes
    assert ax.get_title() == "a, 400 vertices"
    curves = {line.get_color(): line.get_xydata().tolist() for line in ax.lines}
    assert [curves[colour] for colour in view.BEST.values()] == [[[1.0, 0.2]], [[0.1, 0.3]]]
    assert curves[view.MESH_ERROR["color"]] == [[0.0, 0.05], [1.0, 0.05]]


def test_a_speedup_that_is_doubtful_has_another_mark():
    """Hollow: a large error, or a lower bound (arrow); a cross without a number: not judged."""
    names = "vertices motion position_error known same_reached"
    rows = [(8000, "heldout", 0.0035, True, True), (400, "heldout", 9.0, False, True)]
    rows += [(400, "kick", 0.2, True, True), (400, "stiffness", 0.011, True, False)]
    table = frame(names, *rows).assign(elements="springs", scene="a", factor=1, stiffness=1.0)
    table = table.assign(method="ecsw", training_motions=2, iterations=5, coarser_reached=True)
    of = [f"{name}_speedup" for name in ("same", "coarser")]
    table[[*of, *(f"{name}_{end}" for name in of for end in ("low", "high"))]] = 4.0
    same, coarser = declarations()["equal_error"].draw(table=table.assign(recorded=None)).axes
    marks = [line for line in same.lines if len(line.get_xdata()) == 1]
    marks = sorted((line.get_xdata()[0], line.get_marker(), line.get_mfc()) for line in marks)
    assert [marker for _, marker, _ in marks] == ["x", "o", "o", "o"]
    assert [face == "white" for *_, face in marks] == [False, True, True, False]
    assert sorted(text.get_text() for text in same.texts) == ["0.35", "1.1", "20", "\u2191"]
    assert len(coarser.texts) == 3
    assert [t.get_text() for t in same.get_xticklabels()] == ["a, 400", "a, 8,000"]


def test_every_method_has_a_family():
    methods = load_methods(CONFIG / "methods.yaml")
    reductions = {m: Reduction(title=spec.title, rows=spec.rows) for m, spec in methods.items()}
    everything = Drawn(experiments=(), reductions=reductions)
    families = {name: view.look_of(name, "full", everything)[0] for name in everything.methods}
    assert set(families.values()) <= {*view.FAMILIES} - {view.ITERATIONS}
    assert view.look_of("ecsw-1e-02", "pod", everything)[0] == view.WEIGHTED


def invented(errors, times, blown_up=()):
    """Points of one scene, of one method that samples single entries."""
    names = {"scene": "a", "method": "deim", "position_basis": "full", "number": 0, "marker": "o"}
    names |= {"family": view.ENTRIES, "member": "deim"}
    points = pd.DataFrame({view.ERROR: errors, view.TIME: times})
    lost = pd.DataFrame({view.ERROR: np.nan, view.TIME: blown_up})
    own = pd.DataFrame({view.TIME: [2.0], "mesh_error": [0.1]}, index=["a"])
    return view.TradeOffs(points.assign(**names), lost.assign(**names), own)


def drawn(ax, marker):
    lines = [line for line in ax.lines if line.get_marker() == marker]
    return [tuple(map(float, xy)) for line in lines for xy in line.get_xydata()]


def test_points_outside_the_axis_are_arrows_on_its_rim():
    ax = Figure().subplots()
    view.draw_panel(ax, invented([1e-9, 0.1, 1e5], [1.0, 2.0, 3.0], blown_up=[4.0]), "a")
    assert drawn(ax, view.BELOW) == [(1.0, view.LOW)]
    assert drawn(ax, view.ABOVE) == [(3.0, view.HIGH)]
    assert drawn(ax, "o") == [(2.0, 0.1)]
    ((time, height),) = drawn(ax, view.BLOWN_UP)
    assert time == 4.0
    assert view.LOW < height < view.HIGH
    assert ax.get_xlim()[1] > 4.0
