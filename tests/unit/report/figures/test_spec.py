"""config/figures.yaml, the registry and the declared inputs."""

import os
import subprocess
import sys

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.reduction.method import load_methods
from pdrom.report.figures import FIGURES, Holdings, figure_inputs, load_figures
from pdrom.report.figures.catalogue import READS
from pdrom.report.figures.sources import MethodHolding, SceneHolding

from .conftest import ROOT

ENTRY = "singular_values:\n  title: Decay\n  caption: A caption that is long enough.\n"


def test_names_of_configuration_and_registry_agree(specs):
    assert list(specs) == list(FIGURES)
    assert set(READS) == set(FIGURES)


def test_numbers_of_the_paper_are_complete_and_unique(specs):
    assert sorted(s.number for s in specs.values() if s.number) == list(range(1, 10))


def test_methods_exist(specs):
    known = load_methods(ROOT / "config" / "methods.yaml")
    assert {m for spec in specs.values() for m in spec.methods} <= set(known)


def test_every_entry_loads():
    for name in FIGURES:
        assert callable(FIGURES.load(name))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ENTRY + "  colour: red\n", "unknown key 'colour'"),
        (ENTRY + "  frames: [1.5]\n", "frames"),
        (ENTRY + "  ranks: [-1]\n", "ranks"),
        (ENTRY + "  splits: [validation]\n", "splits"),
        (ENTRY.replace("singular_values", "surprise"), "unknown figure 'surprise'"),
        ("singular_values:\n  title: Decay\n", "'caption' is missing"),
        ("- one\n- two\n", "mapping"),
    ],
)
def test_faults_are_named(tmp_path, text, message):
    path = tmp_path / "figures.yaml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as error:
        load_figures(path)
    assert str(path) in str(error.value)


def test_a_scene_that_does_not_exist_is_refused(tmp_path):
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "bend_fall.yaml").touch()
    path = tmp_path / "figures.yaml"
    path.write_text(ENTRY + "  scenes: [bend_fell]\n")
    with pytest.raises(ConfigurationError, match=r"bend_fell.*allowed: bend_fall"):
        load_figures(path)


def test_inputs_follow_the_configuration(specs):
    holdings = Holdings(
        scenes={"spring_twist": SceneHolding(mesh="sheet", groups=("spring",))},
        reductions={"block-deim": MethodHolding(title="b", basis="x", rows="element")},
    )
    assert figure_inputs("spring_runs", specs["spring_runs"], holdings) == [
        "results/meshes/sheet.h5",
        "results/fom/spring_twist/train.h5",
        "results/reruns/spring_twist/spring/block-deim.h5",
        "results/tables/sensitivity.csv",
    ]
    assert figure_inputs("bar_runs", specs["bar_runs"], holdings) == [
        "results/tables/sensitivity.csv"
    ]
    with pytest.raises(ConfigurationError, match="unknown figure"):
        figure_inputs("surprise", specs["bar_runs"], holdings)


def test_figures_of_one_experiment_read_one_experiment(study, specs):
    name = "deim_iterations"
    paths = figure_inputs(name, specs[name], study.sources.holdings)
    assert len(paths) == len(READS[name])


def test_holdings_survive_a_round_trip(study):
    holdings = study.sources.holdings
    assert Holdings.model_validate(holdings.model_dump(mode="json")) == holdings


def test_declaring_figures_loads_no_plotting_library():
    code = "import sys, pdrom.report.figures; sys.exit('matplotlib' in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0
