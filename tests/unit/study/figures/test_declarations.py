"""Declarations of figures, and their inputs in a study."""

import os
import subprocess
import sys

import pytest

from pdrom.model.effects import EFFECTS
from pdrom.reduction.method import load_methods
from pdrom.view import style
from places import CONFIG, ROOT
from study.figures.kit.declaration import METHODS, declarations, method_styles
from study.pipeline.scenes import scene_names


def test_figures_name_scenes_methods_and_groups_that_exist():
    known = {
        "scenes": {*scene_names(ROOT)}, "methods": {*load_methods(CONFIG / "methods.yaml")},
        "groups": {*EFFECTS},
    }  # fmt: skip
    for name, made in declarations().items():
        assert [
            kind for kind, names in known.items() if not {*getattr(made, kind).split()} <= names
        ] == [], name


@pytest.mark.parametrize("name", ["strain_runs", "teaser", "local_share", "ladder", "spring_runs"])
def test_a_study_without_the_scenes_of_a_figure_draws_similar_scenes(small_study, name):
    study = small_study(["strain_twist"], ["pod"])
    drawn = study.job(name, scenes=("strain_oop",)).settings["drawn"]
    fitting = [] if name == "spring_runs" else ["strain_twist"]
    assert [each["scene"] for each in drawn["experiments"]] == fitting
    assert [*drawn["reductions"]] == ["pod"]


def test_planning_loads_no_plotting_library():
    code = (
        "import sys, study.pipeline.plan;"
        "from study.figures.kit.declaration import declarations; declarations();"
        "sys.exit('matplotlib' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0


def test_every_method_has_a_unique_colour_and_marker():
    for looks in (METHODS.values(), style.GROUP_LOOKS):
        assert [len({*column}) for column in zip(*looks, strict=True)] == [len(looks)] * 2
    named = method_styles(["pod", "mine", "yours"])
    assert len(set(named.values())) == 3
    assert named["mine"] == method_styles(["yours", "mine"])["mine"]
