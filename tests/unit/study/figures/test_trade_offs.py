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
    LOW,
    TIME,
    WEIGHTED,
    Model,
    TradeOffs,
    draw_panel,
    handles,
    label_iterations,
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
    families = {name: Model(name, "full").family(everything) for name in everything.methods}
    assert set(families.values()) <= set(FAMILIES[1:])
    assert {families[name] for name in ("deim", "deim-joint", "published")} == {ENTRIES}
    assert Model("ecsw-1e-02", "pod").family(everything) == WEIGHTED
    assert Model("full", "skinning").family(everything) == WEIGHTED
    assert Model("block-deim", "pod").family(everything) == INTERPOLATED
    assert Model("not drawn", "full").family(everything) is None


def test_models_that_differ_by_tolerance_or_basis_share_a_marker(everything):
    names = [
        ("full", "pod"), ("ecsw-1e-02", "pod"), ("ecsw-1e-03", "pod"), ("full", "skinning"),
        ("ecsw-1e-02", "skinning"), ("deim", "full"), ("deim-joint", "full"),
    ]  # fmt: skip
    found = markers([Model(*name) for name in names], everything)
    sampled = {found[Model("ecsw-1e-02", "pod")], found[Model("ecsw-1e-03", "pod")]}
    assert sampled == {found[Model("ecsw-1e-02", "skinning")]}
    assert sampled != {found[Model("full", "pod")]}
    assert found[Model("full", "pod")] == found[Model("full", "skinning")]
    assert Model("full", "skinning").hollow
    assert not Model("full", "pod").hollow
    assert found[Model("deim", "full")] != found[Model("deim-joint", "full")]
    nothing = TradeOffs(everything, pd.DataFrame(), pd.DataFrame(), {}, {}, found)
    legend = dict(handles(nothing))
    assert [line.get_label() for line in legend[WEIGHTED.title]] == [
        "all projections", "ecsw, by tolerance",
    ]  # fmt: skip


def invented(errors, times, method="deim", blown_up=()):
    """Points of one scene, of one method that samples single entries."""
    names = {"scene": "a", "method": method, "position_basis": "full", "family": ENTRIES.title}
    points = pd.DataFrame({ERROR: errors, TIME: times, "iterations": range(1, len(errors) + 1)})
    lost = pd.DataFrame({ERROR: np.nan, TIME: blown_up})
    marker = {Model("deim", "full"): "o"}
    none = Drawn(
        experiments=(), reductions={"deim": Reduction(title="deim", rows="scalar")}, groups=()
    )
    return TradeOffs(none, points.assign(**names), lost.assign(**names), {"a": 2.0}, {}, marker)


def drawn(ax, marker):
    """Points with a marker."""
    lines = [line for line in ax.lines if line.get_marker() == marker]
    return [tuple(map(float, xy)) for line in lines for xy in line.get_xydata()]


def test_points_outside_the_axis_are_arrows_on_its_rim(everything):
    ax = Figure().subplots()
    draw_panel(ax, invented([1e-9, 0.1, 1e5], [1.0, 2.0, 3.0], blown_up=[4.0]), "a")
    assert drawn(ax, BELOW) == [(1.0, LOW)]
    assert drawn(ax, ABOVE) == [(3.0, HIGH)]
    assert drawn(ax, "o") == [(2.0, 0.1)]
    ((time, height),) = drawn(ax, BLOWN_UP)
    assert time == 4.0
    assert LOW < height < HIGH
    assert ax.get_xlim()[1] > 4.0


def test_the_front_of_a_family_is_not_beaten(everything):
    ax = Figure().subplots()
    draw_panel(ax, invented([0.5, 0.7, 0.1, 0.2], [1.0, 2.0, 3.0, 4.0]), "a")
    (front,) = [
        line for line in ax.lines if line.get_drawstyle() == "steps-post" and len(line.get_xdata())
    ]
    assert front.get_xydata().tolist() == [[1.0, 0.5], [3.0, 0.1]]


def test_near_numbers_of_iterations_share_a_label(everything):
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
