"""Names stand for files, a study's files lie in its own folder, misspelt ones get a suggestion."""

import re
from dataclasses import dataclass

import pytest

from pdrom.core.errors import ConfigurationError
from study.pipeline.folders import Folders
from study.pipeline.targets import Known, Names

NAMES = Names(["scaling", "floor"], ["scaling", "claims"])
TINY = Folders("results/studies/tiny", "results/studies/tiny/paper/main.pdf")


@pytest.mark.parametrize(
    ("target", "names"),
    [
        ("floor", ["figures/floor.pdf"]),
        ("claims", ["tables/claims.csv"]),
        ("scaling", ["figures/scaling.pdf", "tables/scaling.csv"]),
        ("figure scaling", ["figures/scaling.pdf"]),
        ("results/fom/a.h5", ["fom/a.h5"]),
    ],
)
def test_files_of_a_target(target, names):
    for place in (Folders(), TINY):
        assert NAMES.files(target, place) == [f"{place.results}/{name}" for name in names]


def test_files_that_have_a_place_of_their_own():
    for name in ("results/studies/tiny/x", "figure_floor", "figure none"):
        assert NAMES.files(name, Folders()) == NAMES.files(name, TINY) == [name]
    for name in ("paper/main.pdf", "paper/supplement.pdf"):
        assert NAMES.files(name, Folders()) == [name]
        assert NAMES.files(name, TINY) == [f"results/studies/tiny/{name}"]


@dataclass
class Rule:
    """A rule of Snakemake that makes what its pattern matches."""

    name: str
    pattern: str
    wildcards: bool = False

    def has_wildcards(self) -> bool:
        return self.wildcards

    def is_producer(self, requested_output: str) -> bool:
        return re.fullmatch(self.pattern, requested_output) is not None


RULES = [
    Rule("fom", r"results/fom/[a-z_]+/(train|heldout)\.h5", True),
    Rule("pod", r"results/snapshots/[a-z_]+/[a-z_]+\.h5", True),
    Rule("scaling_table", r"results/tables/scaling\.csv"),
]
GROUPS = {"sheet": ("spring",), "bar": ("strain", "bending")}
KNOWN = Known(
    results="results",
    files=["results/tables/scaling.csv", "results/tables/claims.csv"],
    names=NAMES,
    labels={"scene": lambda labels: GROUPS, "group": lambda labels: GROUPS[labels["scene"]]},
)


@pytest.mark.parametrize(
    "target",
    [
        "scaling_table",
        "results/tables/scaling.csv",
        "results/fom/bar/heldout.h5",
        "results/snapshots/bar/strain.h5",
    ],
)
def test_what_a_rule_makes_is_a_target(target):
    KNOWN.check([target], RULES)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("results/tabels/scaling.csv", "did you mean 'results/tables/scaling.csv'?"),
        ("scalign", "did you mean 'scaling'?"),
        ("scaling_tabel", "did you mean 'scaling_table'?"),
        ("results/fom/baar/train.h5", "unknown scene 'baar', did you mean 'bar'?"),
        ("results/snapshots/bar/strian.h5", "unknown group 'strian', did you mean 'strain'?"),
        ("results/snapshots/sheet/strain.h5", "unknown group 'strain'"),
        ("bar", "a scene; name one of its files, as results/fom/bar/train.h5"),
        ("fom", "nothing makes it"),
        ("something/quite/different", "targets are names of figures and tables"),
    ],
)
def test_what_nobody_makes_is_named_with_a_suggestion(target, words):
    with pytest.raises(ConfigurationError) as caught:
        KNOWN.check([target], RULES)
    assert words in str(caught.value)
    assert f"'{target}'" in str(caught.value)
