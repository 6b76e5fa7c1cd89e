"""What figures declare, config/figures.yaml, and the inputs that follow from both."""

import os
import subprocess
import sys
from dataclasses import replace

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.reduction.method import load_methods
from study.artifact.paths import MESH, RERUNS
from study.figures.kit.catalogue import declaration, declarations, load_choices
from study.figures.kit.holdings import GroupHolding, Holdings, MethodHolding, SceneHolding
from study.figures.kit.options import Scenes

from .conftest import ROOT

ENTRY = "singular_values:\n  columns: 2\n"


def test_figures_of_the_paper_come_first_in_their_order():
    numbers = [figure.number for figure in declarations().values()]
    assert numbers[:9] == list(range(1, 10))
    assert set(numbers[9:]) == {None}


@pytest.mark.parametrize("changed", [None, {"name": "rung"}])
def test_a_module_declares_one_figure_of_its_own_name(monkeypatch, changed):
    figure = declaration("ladder")
    wrong = changed and replace(figure, **changed)
    monkeypatch.setattr(sys.modules[figure.module], "ladder", wrong)
    with pytest.raises(ConfigurationError, match="ladder: must declare one figure, called ladder"):
        declarations.__wrapped__()


def test_methods_exist(specs):
    known = load_methods(ROOT / "config" / "methods.yaml")
    assert {m for options in specs.values() for m in options.names("methods")} <= set(known)


def test_a_figure_without_an_entry_has_its_defaults(tmp_path):
    path = tmp_path / "figures.yaml"
    path.write_text(ENTRY)
    chosen = load_choices(path)
    assert list(chosen) == list(declarations())
    assert chosen["ladder"] == Scenes()
    assert chosen["singular_values"].columns == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ENTRY + "  colour: red\n", "unknown key 'colour'"),
        (ENTRY + "  ranks: [6]\n", r"unknown key 'ranks' \(allowed: .*columns"),
        ("ladder:\n  columns: 2\n", r"unknown key 'columns' \(allowed: scenes\)"),
        (ENTRY + "  caption: Another caption.\n", "unknown key 'caption'"),
        ("bar_runs:\n  frames: [1.5]\n", "frames"),
        ("bar_runs:\n  frames: []\n", "frames"),
        ("bar_runs:\n  ranks: [-1]\n", "ranks"),
        ("reconstruction_error:\n  splits: [validation]\n", "splits"),
        (ENTRY.replace("singular_values", "surprise"), "unknown figure 'surprise'"),
        ("- one\n- two\n", "mapping"),
    ],
)
def test_faults_are_named(tmp_path, text, message):
    path = tmp_path / "figures.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as error:
        load_choices(path)
    assert str(path) in str(error.value)


def test_a_scene_that_does_not_exist_is_refused(tmp_path):
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "bend_fall.yaml").touch()
    path = tmp_path / "figures.yaml"
    path.write_text(ENTRY + "  scenes: [bend_fell]\n")
    with pytest.raises(ConfigurationError, match=r"bend_fell.*allowed: bend_fall"):
        load_choices(path)


HOLDINGS = Holdings(
    scenes={"spring_twist": SceneHolding(mesh="sheet", groups=("spring",))},
    methods={"block-deim": MethodHolding(title="b", basis="x", rows="element")},
    groups={"spring": GroupHolding(place=1, cells="edge", unit="m")},
)


def test_files_follow_the_configuration(specs):
    springs, bars = specs["spring_runs"], specs["bar_runs"]
    assert list(HOLDINGS.files(MESH, springs, "r", first=False)) == ["r/meshes/sheet.h5"]
    assert list(HOLDINGS.files(RERUNS, springs, "r", first=False)) == [
        "r/reruns/spring_twist/spring/block-deim.h5"
    ]
    assert list(HOLDINGS.files(RERUNS, bars, "r", first=False)) == []


def test_figures_of_one_experiment_read_one_experiment(study, specs):
    options, holdings = specs["deim_iterations"], study.results.holdings
    assert len(list(holdings.files(RERUNS, options, "r", first=True))) == 1
    assert len(list(holdings.files(RERUNS, options, "r", first=False))) > 1


def test_an_unknown_figure_is_named():
    with pytest.raises(ConfigurationError, match=r"unknown figure 'lader'.*did you mean 'ladder'"):
        declaration("lader")


def test_holdings_survive_a_round_trip(study):
    holdings = study.results.holdings
    assert Holdings.model_validate(holdings.model_dump(mode="json")) == holdings


def test_planning_loads_no_plotting_library():
    code = (
        "import sys, study.pipeline.plan;"
        "from study.figures.kit.catalogue import declarations; declarations();"
        "sys.exit('matplotlib' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0
