"""Accuracy against time: families of models, points outside the axis, runs that blew up."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pdrom.reduction.method import load_methods
from places import ROOT
from study.figures import accuracy_cost as view
from study.figures.kit.options import Drawn, Reduction


@pytest.fixture
def everything():
    """Every method of the project, and no scene."""
    methods = load_methods(ROOT / "config" / "methods.yaml")
    reductions = {m: Reduction(title=spec.title, rows=spec.rows) for m, spec in methods.items()}
    return Drawn(experiments=(), reductions=reductions, groups=())


def test_every_method_of_the_project_has_a_family(everything):
    families = {name: view.look_of(name, "full", everything)[0] for name in everything.methods}
    assert set(families.values()) <= {*view.FAMILIES} - {view.ITERATIONS}
    assert {families[name] for name in ("deim", "deim-joint", "published")} == {view.ENTRIES}
    assert view.look_of("ecsw-1e-02", "pod", everything)[0] == view.WEIGHTED
    assert view.look_of("full", "skinning", everything)[0] == view.WEIGHTED
    assert view.look_of("block-deim", "pod", everything)[0] == view.INTERPOLATED
    assert view.look_of("not drawn", "full", everything)[0] is None


def test_models_that_differ_by_tolerance_or_basis_share_a_marker(everything):
    ecsw = view.look_of("ecsw-1e-02", "pod", everything)
    assert ecsw == view.look_of("ecsw-1e-03", "skinning", everything)
    assert view.look_of("full", "pod", everything) == view.look_of("full", "skinning", everything)
    names = [("full", "pod"), ("ecsw-1e-02", "pod"), ("deim", "full"), ("deim-joint", "full")]
    looks = [view.look_of(*name, everything) for name in names]
    found = view.markers([*looks, ecsw])
    assert list(found) == looks
    assert [found[look] for look in looks] == ["o", "s", "o", "s"]
    legend = dict(view.handles(view.TradeOffs(pd.DataFrame(), pd.DataFrame(), {}, {}, found)))
    assert [line.get_label() for line in legend[view.WEIGHTED]] == [
        "all projections", "ecsw, by tolerance",
    ]  # fmt: skip


def invented(errors, times, method="deim", blown_up=(), position_basis="full"):
    """Points of one scene, of one method that samples single entries."""
    names = {"scene": "a", "method": method, "position_basis": position_basis}
    names |= {"family": view.ENTRIES, "member": "deim"}
    points = pd.DataFrame({view.ERROR: errors, view.TIME: times})
    points["iterations"] = points.index + 1
    lost = pd.DataFrame({view.ERROR: np.nan, view.TIME: blown_up})
    marker = {(view.ENTRIES, "deim"): "o"}
    return view.TradeOffs(points.assign(**names), lost.assign(**names), {"a": 2.0}, {}, marker)


def drawn(ax, marker):
    """Points with a marker."""
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


@pytest.mark.parametrize(("basis", "fill"), [("pod", "full"), ("skinning", "none")])
def test_points_in_a_subspace_of_skinning_weights_are_hollow(basis, fill):
    ax = Figure().subplots()
    view.draw_panel(ax, invented([0.1], [2.0], position_basis=basis), "a")
    assert next(line.get_fillstyle() for line in ax.lines if len(line.get_xdata()) == 1) == fill


def test_the_front_of_a_family_is_not_beaten():
    ax = Figure().subplots()
    view.draw_panel(ax, invented([0.5, 0.7, 0.1, 0.2], [1.0, 2.0, 3.0, 4.0]), "a")
    (front,) = [
        line for line in ax.lines if line.get_drawstyle() == "steps-post" and len(line.get_xdata())
    ]
    assert front.get_xydata().tolist() == [[1.0, 0.5], [3.0, 0.1]]


def test_near_numbers_of_iterations_share_a_label():
    ax = Figure().subplots()
    found = invented([0.3, 0.2, 0.1], [1.0, 1.01, 9.0], method="fewer-iterations")
    view.draw_panel(ax, found, "a")
    view.label_iterations(ax, found, "a")
    assert [text.get_text() for text in ax.texts] == ["K = 1, 2", "K = 3"]


def test_one_scene_is_large_and_each_other_group_has_one(study):
    figure = study.draw("accuracy_cost")
    titles = [ax.get_title() for ax in figure.axes]
    assert titles[0] == "deformation gradient: bar release"
    assert titles[1:] == ["strain:\nstrain oop", "bending:\nbend curved",
                          "tetrahedron strain:\nbar twist"]  # fmt: skip
