"""What figures declare, config/figures.yaml, and the inputs that follow from both."""

import os
import subprocess
import sys

import pytest

from pdrom.core.errors import ConfigurationError
from study.artifact.paths import MESH, RERUNS
from study.figures.kit.declaration import Scenes, declarations, figure, load_choices

ENTRY = "singular_values:\n  columns: 2\n"


def test_figures_of_the_paper_come_first_in_their_order():
    numbers = [declared.number for declared in declarations().values()]
    assert numbers[:9] == list(range(1, 10))
    assert set(numbers[9:]) == {None}


def test_a_figure_has_a_caption():
    with pytest.raises(TypeError, match="no docstring, which is its caption"):
        figure(title="Nothing", reads={})(lambda options: options)


def test_a_figure_without_an_entry_has_its_defaults(tmp_path):
    path = tmp_path / "figures.yaml"
    path.write_text(ENTRY)
    chosen = load_choices(path, {})
    assert list(chosen) == list(declarations())
    assert chosen["ladder"] == Scenes()
    assert chosen["singular_values"].columns == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ladder:\n  columns: 2\n", r"unknown key 'columns' \(allowed: scenes\)"),
        (ENTRY + "  caption: Another caption.\n", "unknown key 'caption'"),
        ("bar_runs:\n  frames: []\n", "frames"),
        ("bar_runs:\n  ranks: [-1]\n", "ranks"),
    ],
)
def test_faults_are_named(tmp_path, text, message):
    path = tmp_path / "figures.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as error:
        load_choices(path, {})
    assert str(path) in str(error.value)


def test_files_follow_the_configuration(study, small_study):
    """Figures of one experiment read one."""
    invented = small_study(["spring_twist"], ["block-deim"])
    inputs = invented.job("spring_runs").inputs
    assert inputs["meshes"] == [invented.path(MESH, "spring_twist")]
    assert inputs["reruns"] == [invented.path(RERUNS, "spring_twist", "spring", "block-deim")]
    assert len(study.job("deim_iterations").inputs["samples"]) == 1
    assert len(study.job("deim_entries").inputs["samples"]) > 1


@pytest.mark.parametrize("name", ["bar_runs", "spring_runs", "teaser", "local_share", "ladder"])
def test_a_list_of_which_a_study_holds_nothing_means_all_that_it_holds(small_study, name):
    invented = small_study(["strain_twist"], ["pod"])
    assert "strain_twist" not in invented.study.figures[name].scenes
    settings = invented.job(name).settings
    assert settings["options"]["scenes"] == []
    if "drawn" in settings:
        assert [each["scene"] for each in settings["drawn"]["experiments"]] == ["strain_twist"]
        assert [*settings["drawn"]["reductions"]] == ["pod"]


def test_planning_loads_no_plotting_library():
    code = (
        "import sys, study.pipeline.plan;"
        "from study.figures.kit.declaration import declarations; declarations();"
        "sys.exit('matplotlib' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0
