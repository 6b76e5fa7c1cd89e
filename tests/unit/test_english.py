"""Pages, the paper, captions and descriptions avoid words that only this project understood."""

import re
from collections.abc import Iterator

import pytest

from places import ROOT, tracked
from study.figures.kit.declaration import declarations
from study.tables import declared
from study.tables.claims.rules import load_claims

PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md", "docs/**/*.md")
REFUSED = (
    "playback", "held[- ]out", "gains?", "whole elements?", "joint rows?", "twins?", "rungs?",
    "pays", "dear", "promises?", "by a hair", "round-?off decides", "a tenth", "a hundredth",
    "opponents?", "motions?",
)  # fmt: skip
# Terms of other fields, in which a refused word is part of a name.
TERMS = re.compile(
    r"\brigid[ -]motions?\b|\bequations? of motion\b|\bMotion in Games\b", re.IGNORECASE
)
WORDS = re.compile(rf"\b(?:{'|'.join(REFUSED)})\b", re.IGNORECASE)
# Text that no reader sees as prose: code in Markdown, addresses; names, keys and comments in TeX.
CODE = re.compile(r"```.*?```|`[^`]*`|(?<=\])\([^)]*\)", re.DOTALL)
KEYS = re.compile(
    r"(?<!\\)%.*|\\(?:texttt|n|ref|eqref|label|cite|figureof|input|tablefile)\{[^{}]*\}"
)


def refused(text: str) -> list[str]:
    """Refused words of a text, each with the words around it."""
    prose = TERMS.sub(" ", " ".join(text.split()))
    return [prose[max(found.start() - 30, 0) : found.end() + 30] for found in WORDS.finditer(prose)]


def texts() -> Iterator[tuple[str, str]]:
    """Place and text of everything that the rule is for."""
    for path in tracked("--", *(f":(glob){pattern}" for pattern in PAGES)):
        yield str(path.relative_to(ROOT)), CODE.sub(" ", path.read_text("utf-8"))
    for path in tracked("--", ":(glob)paper/**/*.tex"):
        yield str(path.relative_to(ROOT)), KEYS.sub(" ", path.read_text("utf-8"))
    for name, figure in declarations().items():
        yield f"figure {name}", CODE.sub(" ", f"{figure.title}. {figure.caption}")
    for name, table in declared().items():
        described = [table.title, *(column.meaning for column in table.columns)]
        yield f"table {name}", CODE.sub(" ", ". ".join(described))
    for name, rule in load_claims(ROOT / "config" / "claims.yaml").items():
        tests = (*rule.published, *rule.beyond)
        yield f"claim {name}", " ".join([rule.text, rule.paper, *(test.what for test in tests)])


@pytest.mark.parametrize(("place", "text"), [pytest.param(*one, id=one[0]) for one in texts()])
def test_a_text_avoids_the_refused_words(place: str, text: str) -> None:
    assert refused(text) == [], place


@pytest.mark.parametrize("text", ["Whole\nelements", "the gain", "a Twin scene", "held-out runs"])
def test_a_refused_word_is_found(text: str) -> None:
    assert len(refused(text)) == 1


def test_terms_of_other_fields_are_allowed() -> None:
    assert refused("a rigid motion, vertices held by a wall, again") == []
