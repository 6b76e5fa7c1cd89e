"""Pages for readers name existing files, headings, commands and keys."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from pdrom.model.effects import EFFECTS
from pdrom.model.held_out import FIRST
from pdrom.model.mesh.selection import KINDS
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from places import CONFIG, ROOT, tracked
from study.artifact.paths import RESULTS
from study.figures.runs import TOLERANCE
from study.paper.numbers import entries, number_of
from study.pipeline.study import StudySettings
from study.verification.compare import folder_of, read_references
from vocabulary import gone, known

PAGES = sorted([ROOT / "README.md", ROOT / "config" / "README.md", *(ROOT / "docs").rglob("*.md")])
SHOWN = {"published": ("r", 20), "gappy": ("r", 20), TOLERANCE: ("k", 10)}  # in docs/teaser.png
ADDING = ROOT / "docs" / "adding.md"
# Untimed sentences of the README's answer, with the names of numbers in paper/numbers.yaml.
ANSWER = (
    "{claimsHold} hold, {claimsMixed} hold in some cases only",
    "Of {threeForOneFailing} simulations with a position error above 10 %, {threeForOneRescued}",
    "below 10 % in {improvedAccurate} of {improvedOf} cases on the training trajectory",
    "below 10 % in {improvedTest} of the {improvedOf} cases",
    "its error is {barErrorLeast} to {barErrorMost} % on three test trajectories",
)
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
LINK = re.compile(r"\]\(([^)#]+)[^)]*\)")
NAMED = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
CODE = re.compile(r"(?<![\w`])`+([^`\s](?:[^`\n]*[^`\s])?)`+")
FILE = re.compile(
    r"(?<![\w{}./*$-])[\w{}./*-]*\w\.(?:py|js|smk|tex|yaml|sh|css)\b|\bpdrom(?:\.\w+){2,}"
)


def headings(page: Path) -> set[str]:
    """Anchors of a page, as GitHub makes them."""
    found = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title).strip().lower().replace(" ", "-") for title in found}


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_lead_to_files_and_headings_that_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    inside = [link for link in LINK.findall(text) if "://" not in link]
    assert [link for link in inside if not (page.parent / link).exists()] == []
    links = re.findall(r"\]\(([^):]*)#([^)]+)\)", text)
    targets = [(page.parent / file if file else page, anchor) for file, anchor in links]
    assert [a for target, a in targets if a not in headings(target)] == []


def spans(text: str) -> Iterator[str]:
    """Texts in code font and commands; a key that begins with a dot follows its section."""
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        yield from (line.partition(" #")[0] for line in block.splitlines())
    for line in re.sub(r"```.*?```", "", text, flags=re.DOTALL).splitlines():
        section = ""
        for span in CODE.findall(line):
            if re.fullmatch(r"[a-z_]+(\.\w+)+", span):
                section = span.rpartition(".")[0]
            yield section + span if section and re.fullmatch(r"\.\w+", span) else span


@pytest.mark.parametrize("page", NAMED, ids=[str(page.relative_to(ROOT)) for page in NAMED])
def test_names_in_code_font_exist(page: Path) -> None:
    """Modules, commands, options, keys, files, and names that a recipe of the page defines."""
    text = page.read_text("utf-8").split("\n## 0.")[0]  # of the releases only the next one
    if page.name == "0018-what-was-given-up.md":
        text = re.sub(r"^\| [^|]* \|", "|", text, flags=re.MULTILINE)
    recipes = re.findall(r"```(?:python|yaml|tex)\n(.*?)```", text, re.DOTALL)
    own = {*re.findall(r"\w+", "".join(recipes)), *re.findall(r"(?m)^`([^`]+)`:$", text)}
    wrong = [word for span in spans(text) for word in gone(span, own)]
    assert wrong + [name for name in FILE.findall(text) if not known(name, own)] == []


def test_files_modules_and_commands_that_sources_name_exist() -> None:
    wrong = []
    for path in tracked("src", "workflow", "config/*.yaml", "paper", "reproduce", "Snakefile"):
        text = path.read_text("utf-8")
        text = "\n".join(re.findall(r"%.*", text)) if path.suffix == ".tex" else text
        words = [word for span in CODE.findall(text) for word in gone(span)]
        words = [w for w in words if re.match(r"--|(pdrom|study)[. ]", w)]
        words += [w for w in FILE.findall(text) if not known(w)]
        wrong += [f"{path.relative_to(ROOT)}: {w}" for w in words]
    assert wrong == []


@pytest.mark.parametrize(
    "span",
    [
        "pdrom advise", "pdrom show --plot", "./reproduce --certify", "pdrom.core.gone",
        "core/gone.py", "src/pdrom/errors.py", "docs/gone", "gone.csv", "stability.sweeps",
        "{kind: x5y}",
    ],
)  # fmt: skip
def test_a_name_that_no_longer_exists_is_found(span: str) -> None:
    assert list(gone(span)) != []


def test_the_scene_the_study_and_the_method_that_are_added_are_valid() -> None:
    pages = ADDING.read_text("utf-8") + (CONFIG / "README.md").read_text("utf-8")
    blocks = re.findall(r"```yaml\n(.*?)```", pages, re.DOTALL)
    scene, study, methods, keys, bar = map(yaml.safe_load, blocks)
    assert SceneConfig.model_validate(scene).groups == ["spring"]
    assert SceneConfig.model_validate(bar).groups == ["deformation_gradient", "volume"]
    assert StudySettings.model_validate(study).online.scenes == ()
    assert StudySettings.model_validate(keys).online.scenes == ("bar80",)
    assert [MethodSpec.model_validate(method).rows for method in methods.values()] == ["scalar"]


def test_effects_and_selections_are_listed_and_those_that_no_subspace_accepts() -> None:
    page, text = (CONFIG / "README.md").read_text("utf-8"), ADDING.read_text("utf-8")
    (sentence,) = re.findall(r"^Effects: (.*?)\.\n", text, re.MULTILINE | re.DOTALL)
    assert sorted(re.findall(r"`(\w+)`", sentence)) == sorted(EFFECTS)
    (others,) = re.findall(r"^Models in .* support all effects but (.*?),", page, re.MULTILINE)
    refused = {name for name in EFFECTS if not EFFECTS.load(name).in_subspace}
    assert set(re.findall(r"`(\w+)`", others)) == refused
    selections = page.split("### Selections")[1].split("\n###")[0]
    kinds = re.findall(r"`\{kind: (\w+), ", selections)
    assert sorted(kinds) == sorted(KINDS)


def test_the_verdicts_of_the_readme_are_the_expected_ones() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    shown = re.findall(r"^\| (C\d+): [^|]* \| ([^|]*) \| ([^|]*) \|", text, re.MULTILINE)
    found = read_references(ROOT / folder_of(RESULTS))["claims"]
    rows = found.frame[["claim", "verdict", "verdict_beyond"]]
    assert shown == list(rows.itertuples(index=False, name=None))


def test_the_numbers_of_the_readme_s_picture_are_those_of_the_expected_tables() -> None:
    runs = read_references(ROOT / folder_of(RESULTS))["reduced_reruns"].frame
    runs = runs[runs.motion == FIRST].set_index(["scene", "method"])
    errors = [
        100.0 * runs.loc[(scene, method)].set_index(size).relative_error_within_horizon[modes]
        for scene in ("bar_release", "spring_oop")
        for method, (size, modes) in SHOWN.items()
    ]
    caption = (ROOT / "README.md").read_text("utf-8").split("docs/teaser.png)")[1].split("*\n")[0]
    assert re.findall(r"([\d.]+) %", caption) == [f"{float(f'{e:.2g}'):g}" for e in errors]


def test_the_numbers_of_the_readme_s_answer_are_those_of_the_paper() -> None:
    text = (ROOT / "README.md").read_text("utf-8").split("## The answer")[1].split("\n## ")[0]
    tables = read_references(ROOT / folder_of(RESULTS))
    frames, known = {name: found.frame for name, found in tables.items()}, entries(ROOT / "paper")
    for sentence in ANSWER:
        names = re.findall(r"\w+(?=\})", sentence)
        shown = {name: number_of(name, known, frames).text for name in names}
        assert sentence.format(**shown) in text
