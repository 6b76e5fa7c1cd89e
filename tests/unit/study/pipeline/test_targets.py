"""Names stand for files, a study's files lie in its own folder, misspelt ones get a suggestion."""

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


def rule(name: str, pattern: str, wildcards: bool = False) -> SimpleNamespace:
    makes = re.compile(pattern).fullmatch
    return SimpleNamespace(name=name, has_wildcards=lambda: wildcards, is_producer=makes)


RULES = [
    rule("fom", r"results/fom/[a-z_0-9]+/(train|heldout)\.h5", True),
    rule("mesh", r"results/meshes/[A-Za-z0-9_.-]+\.h5", True),
    rule("snapshots", r"results/snapshots/[a-z_]+/[a-z_]+\.h5", True),
    rule("reruns", r"results/reruns/[a-z_]+/[a-z_]+/[a-z-]+\.h5", True),
    rule("scaling_table", r"results/tables/scaling\.csv"),
]


@pytest.fixture(scope="module")
def plan():
    config = {
        "scenes": ["strain_oop"], "methods": ["deim"],
        "coarsen": {"resolution": 0.3, "frames": 0.1},
    }  # fmt: skip
    return Plan(Study(config, ROOT))


def test_what_a_rule_makes_is_a_target(plan):
    """Files of the study, and of scenes outside it."""
    scenes = [*plan.study.scenes, "bar_twist"]
    wanted = [f"results/fom/{scene}/heldout.h5" for scene in scenes]
    wanted += [f"results/meshes/{mesh}.h5" for mesh in plan.study.meshes]
    wanted += ["results/snapshots/bar_twist/tetrahedron_strain.h5", "results/tables/scaling.csv"]
    check_targets(plan, [*wanted, "scaling_table"], RULES)


@pytest.mark.parametrize(
    ("target", "parts"),
    [
        ("results/tabels/scaling.csv", ["'results/tables/scaling.csv'"]),
        ("scalign", ["'scaling'"]),
        ("scaling_tabel", ["'scaling_table'"]),
        ("results/fom/strain_opo/train.h5", ["scene 'strain_opo'", "'strain_oop'"]),
        ("results/meshes/none.h5", ["mesh 'none'"]),
        ("results/snapshots/strain_oop/strian.h5", ["group 'strian'", "'strain'"]),
        ("results/reruns/strain_oop/strain/deem.h5", ["method 'deem'", "'deim'"]),
        ("fom", ["names of figures and tables", "results/fom/SCENE/train.h5"]),
    ],
)
def test_what_nobody_makes_is_named_with_a_suggestion(target, parts, plan):
    with pytest.raises(ConfigurationError) as caught:
        check_targets(plan, [target], RULES)
    assert [part for part in (f"'{target}'", *parts) if part not in str(caught.value)] == []
