"""Names stand for files, files of a study lie in its folder, wrong names get a suggestion."""

import re
from types import SimpleNamespace

import pytest

from pdrom.core.errors import ConfigurationError
from places import ROOT
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.study import Study
from study.pipeline.targets import check_targets, files

TINY = Folders("results/studies/tiny", "results/studies/tiny/paper/main.pdf")


@pytest.mark.parametrize(
    ("target", "names"),
    [
        ("teaser", ["figures/teaser.pdf"]),
        ("claims", ["tables/claims.csv"]),
        ("scaling", ["figures/scaling.pdf", "tables/scaling.csv"]),
        ("results/fom/a.h5", ["fom/a.h5"]),
    ],
)
def test_files_of_a_target_lie_in_the_folder_of_the_study_unless_named(target, names):
    for place in (Folders(), TINY):
        assert files(target, place) == [f"{place.results}/{name}" for name in names]
    for name in ("results/studies/tiny/x", "figure_teaser"):
        assert files(name, Folders()) == files(name, TINY) == [name]
    for name in ("paper/main.pdf", "paper/supplement.pdf"):
        assert files(name, Folders()) == [name]
        assert files(name, TINY) == [f"results/studies/tiny/{name}"]


RULES = [
    SimpleNamespace(name=name, is_producer=re.compile(pattern).fullmatch)
    for name, pattern in {
        "fom": r"results/fom/[a-z_0-9]+/(train|heldout)\.h5",
        "scaling_table": r"results/tables/scaling\.csv",
    }.items()
]


@pytest.fixture(scope="module")
def plan():
    config = {
        "scenes": ["strain_oop"], "methods": ["deim"],
        "coarsen": {"resolution": 0.3, "frames": 0.1},
    }  # fmt: skip
    return Plan(Study(config, ROOT))


def test_every_file_that_a_rule_makes_is_a_target(plan):
    """Files of the study, and of scenes outside it."""
    scenes = [*plan.study.scenes, "bar_twist"]
    wanted = [f"results/fom/{scene}/heldout.h5" for scene in scenes]
    wanted += ["results/tables/scaling.csv"]
    check_targets(plan, [*wanted, "scaling_table"], RULES)


@pytest.mark.parametrize(
    ("target", "guess"),
    [
        ("results/tabels/scaling.csv", "results/tables/scaling.csv"),
        ("scalign", "scaling"),
        ("scaling_tabel", "scaling_table"),
    ],
)
def test_an_unknown_target_is_named_with_a_suggestion(target, guess, plan):
    with pytest.raises(ConfigurationError, match=f"'{target}': .*'{guess}'"):
        check_targets(plan, [target], RULES)
