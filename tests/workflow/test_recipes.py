"""Each recipe of CONTRIBUTING.md is added to a copy, and the pipeline makes its files.

A block of code below a line "`path`:" is a new file. A block below "`path`, below `line`:" is added
to an existing file under that line, with its indentation.
"""

import re
import shutil
from dataclasses import dataclass

import numpy as np
import pytest
import yaml
from checkout import Checkout, copy_repository
from sandbox import MICRO

from pdrom.core.store import check_file, read_table
from places import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
BLOCK = re.compile(
    r"^`(?P<path>[^`]+)`(?:, below `(?P<below>[^`]+)`)?:\n\n```\w+\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """A block of code that is added below a line of a file or is the complete file."""

    path: str
    below: str | None
    code: str

    def add_to(self, checkout: Checkout) -> None:
        file = checkout.folder / self.path
        if self.below is None:
            assert not file.exists(), f"{self.path} exists"
            file.write_text(self.code, encoding="utf-8")
            return
        lines = file.read_text(encoding="utf-8").splitlines()
        (place,) = [i for i, line in enumerate(lines) if line.strip() == self.below]
        indent = " " * (len(lines[place]) - len(lines[place].lstrip()))
        lines[place + 1 : place + 1] = [indent + line for line in self.code.splitlines()]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def recipe(title: str) -> list[Block]:
    (section,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
    return [Block(**found.groupdict()) for found in BLOCK.finditer(section)]


# Files that a recipe may touch at most; pages that a command writes from the declarations (a list
# of tables, one of figures) are not counted.
MOST = {"A figure": 2, "A table": 2, "A selection": 3, "A constraint group": 3, "An experiment": 1}
SCENE = {
    "name": "cable_sheet",
    "title": "A sheet of cables, hanging from one side",
    "mesh": {"kind": "cloth", "rows": 20, "columns": 20, "plane": "xz", "lift": 2.0},
    "frames": 200,
    "effects": [
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        {"effect": "cable", "weight": 1e5},
    ],
    "reduce": {"cable": {"train": 100}},
}
STUDY = MICRO | {
    "scenes": ["spring_oop", "cable_sheet"],
    "methods": ["leverage", "block-deim"],
    "ranks": [2],
}
ARGUMENTS, RESULTS = ("--configfile", "own.yaml"), "results/studies/own"
MODEL = "tests/unit/pdrom/model"
GROUP_TESTS = ("tests/physics", f"{MODEL}/constraints", f"{MODEL}/dynamics")


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy with all additions of the recipes, and a study that uses them."""
    made = copy_repository(tmp_path_factory.mktemp("recipes"))
    compiled = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "tests", made.folder / "tests", ignore=compiled)
    shutil.copy(ROOT / "pyproject.toml", made.folder)
    for title in MOST:
        for block in recipe(title):
            block.add_to(made)
    (made.folder / "own.yaml").write_text(yaml.safe_dump(STUDY), encoding="utf-8")
    scene = made.folder / "config" / "scenes" / "cable_sheet.yaml"
    scene.write_text(yaml.safe_dump(SCENE), encoding="utf-8")
    return made


@pytest.mark.parametrize("title", MOST)
def test_a_recipe_touches_few_files(title):
    paths = [block.path for block in recipe(title)]
    assert 0 < len(paths) == len(set(paths)) <= MOST[title]


def test_the_added_files_belong_to_the_study(checkout):
    assert {
        f"{RESULTS}/figures/rest_shapes.png",
        f"{RESULTS}/tables/mesh_sizes.csv",
        f"{RESULTS}/reruns/spring_oop/spring/leverage.csv",
        f"{RESULTS}/reruns/cable_sheet/cable/leverage.csv",
        f"{RESULTS}/reruns/cable_sheet/cable/block-deim.csv",
    } <= checkout.planned(*ARGUMENTS)


# One file of each recipe.
MADE = (
    "figures/rest_shapes.pdf", "tables/mesh_sizes.csv", "reruns/spring_oop/spring/leverage.csv",
    "reruns/cable_sheet/cable/block-deim.csv", "rest_lengths/spring_oop.csv",
)  # fmt: skip


@pytest.fixture(scope="module")
def said(checkout: Checkout) -> str:
    """Output of a run that made the files of the recipes."""
    done = checkout.snakemake(*ARGUMENTS, "--", *(f"{RESULTS}/{name}" for name in MADE))
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_the_added_code_makes_its_files(checkout, said):
    made = checkout.folder / RESULTS
    assert {check_file(made / name) for name in MADE} == {"intact"}
    assert (made / "figures/rest_shapes.pdf").read_bytes().startswith(b"%PDF")
    assert (made / "figures/rest_shapes.png").is_file()
    sizes = read_table(made / "tables/mesh_sizes.csv")
    assert list(sizes) == ["mesh", "vertices", "large"]
    assert set(sizes.vertices) == {25}
    assert set(sizes.large) == {True}  # 25 vertices, 20 modes
    sampled = read_table(made / "sampling/spring_oop/spring/leverage.csv")
    assert len(sampled)
    assert (sampled.elements_sampled == 3 * sampled.r).all()
    reduced = read_table(made / "reruns/cable_sheet/cable/block-deim.csv")
    assert list(reduced.r) == [2]
    assert reduced.finite.all()
    assert (reduced.relative_error < 1.0).all()
    assert "Rest lengths of the springs of spring_oop" in said
    lengths = read_table(made / "rest_lengths/spring_oop.csv").length
    # sides and diagonals of the cells of a square sheet
    short, long = sorted(set(lengths.round(9)))
    assert np.isclose(long, np.sqrt(2.0) * short)


@pytest.mark.slow
def test_the_added_group_has_the_properties_of_every_group(checkout):
    """The copy's tests of groups run on the group that its list of groups names now."""
    program = ("-m", "pytest", "-p", "no:cacheprovider", "-k", "cable")
    done = checkout.looks(*GROUP_TESTS, program=program)
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout
