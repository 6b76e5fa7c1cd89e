"""Accuracy against time: families of models, points outside the axis, runs that blew up."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pdrom.reduction.method import load_methods
from places import ROOT
from study.figures.accuracy_cost import (
    ABOVE,
    BELOW,
    BLOWN_UP,
    ENTRIES,
    ERROR,
    FAMILIES,
    HIGH,
    INTERPOLATED,
    ITERATIONS,
    LOW,
    TIME,
    WEIGHTED,
    TradeOffs,
    draw_panel,
    handles,
    label_iterations,
    look_of,
    markers,
)
from study.figures.kit.options import Drawn, Reduction


@pytest.fixture
def everything():
    """Every method of the project, and no scene."""
    methods = load_methods(ROOT / "config" / "methods.yaml")
    reductions = {m: Reduction(title=spec.title, rows=spec.rows) for m, spec in methods.items()}
    return Drawn(experiments=(), reductions=reductions, groups=())


def test_every_method_of_the_project_has_a_family(everything):
    families = {name: look_of(name, "full", everything)[0] for name in everything.methods}
    assert set(families.values()) <= {*FAMILIES} - {ITERATIONS}
    assert {families[name] for name in ("deim", "deim-joint", "published")} == {ENTRIES}
    assert look_of("ecsw-1e-02", "pod", everything)[0] == WEIGHTED
    assert look_of("full", "skinning", everything)[0] == WEIGHTED
    assert look_of("block-deim", "pod", everything)[0] == INTERPOLATED
    assert look_of("not drawn", "full", everything)[0] is None


def test_models_that_differ_by_tolerance_or_basis_share_a_marker(everything):
    ecsw = look_of("ecsw-1e-02", "pod", everything)
    assert ecsw == look_of("ecsw-1e-03", "skinning", everything)
    assert look_of("full", "pod", everything) == look_of("full", "skinning", everything)
    names = [("full", "pod"), ("ecsw-1e-02", "pod"), ("deim", "full"), ("deim-joint", "full")]
    looks = [look_of(*name, everything) for name in names]
    found = markers([*looks, ecsw])
    assert list(found) == looks
    assert [found[look] for look in looks] == ["o", "s", "o", "s"]
    legend = dict(handles(TradeOffs(pd.DataFrame(), pd.DataFrame(), {}, {}, found)))
    assert [line.get_label() for line in legend[WEIGHTED]] == [
        "all projections", "ecsw, by tolerance",
    ]  # fmt: skip


def invented(errors, times, method="deim", blown_up=(), position_basis="full"):
    """Points of one scene, of one method that samples single entries."""
    names = {"scene": "a", "method": method, "position_basis": position_basis}
    names |= {"family": ENTRIES, "member": "deim"}
    points = pd.DataFrame({ERROR: errors, TIME: times, "iterations": range(1, len(errors) + 1)})
    lost = pd.DataFrame({ERROR: np.nan, TIME: blown_up})
    marker = {(ENTRIES, "deim"): "o"}
    return TradeOffs(points.assign(**names), lost.assign(**names), {"a": 2.0}, {}, marker)


def drawn(ax, marker):
    """Points with a marker."""
    lines = [line for line in ax.lines if line.get_marker() == marker]
    return [tuple(map(float, xy)) for line in lines for xy in line.get_xydata()]


def test_points_outside_the_axis_are_arrows_on_its_rim():
    ax = Figure().subplots()
    draw_panel(ax, invented([1e-9, 0.1, 1e5], [1.0, 2.0, 3.0], blown_up=[4.0]), "a")
    assert drawn(ax, BELOW) == [(1.0, LOW)]
    assert drawn(ax, ABOVE) == [(3.0, HIGH)]
    assert drawn(ax, "o") == [(2.0, 0.1)]
    ((time, height),) = drawn(ax, BLOWN_UP)
    assert time == 4.0
    assert LOW < height < HIGH
    assert ax.get_xlim()[1] > 4.0


@pytest.mark.parametrize(("basis", "fill"), [("pod", "full"), ("skinning", "none")])
def test_points_in_a_subspace_of_skinning_weights_are_hollow(basis, fill):
    ax = Figure().subplots()
    draw_panel(ax, invented([0.1], [2.0], position_basis=basis), "a")
    assert next(line.get_fillstyle() for line in ax.lines if len(line.get_xdata()) == 1) == fill


def test_the_front_of_a_family_is_not_beaten():
    ax = Figure().subplots()
    draw_panel(ax, invented([0.5, 0.7, 0.1, 0.2], [1.0, 2.0, 3.0, 4.0]), "a")
    (front,) = [
        line for line in ax.lines if line.get_drawstyle() == "steps-post" and len(line.get_xdata())
    ]
    assert front.get_xydata().tolist() == [[1.0, 0.5], [3.0, 0.1]]


def test_near_numbers_of_iterations_share_a_label():
    ax = Figure().subplots()
    found = invented([0.3, 0.2, 0.1], [1.0, 1.01, 9.0], method="fewer-iterations")
    draw_panel(ax, found, "a")
    label_iterations(ax, found, "a")
    assert [text.get_text() for text in ax.texts] == ["K = 1, 2", "K = 3"]


def test_one_scene_is_large_and_each_other_group_has_one(study):
    figure = study.draw("accuracy_cost")
    titles = [ax.get_title() for ax in figure.axes]
    assert titles[0] == "deformation gradient: bar release"
    assert titles[1:] == ["strain:\nstrain oop", "bending:\nbend curved",
                          "tetrahedron strain:\nbar twist"]  # fmt: skip
