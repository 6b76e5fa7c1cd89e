"""The size of the project, counted in the files that git tracks, stays within limits.

A change that meets a limit deletes what has no reader.
"""

import re
from functools import cache

import pytest

from places import tracked

LIMITS = {
    "lines of src": 34_136,
    "lines of tests": 21_240,
    "words of documentation": 18_000,
    "tables": 27,
    "figures": 22,
    "experiments": 20,
}
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md", "docs/**/*.md")


@cache
def texts(*patterns: str) -> list[str]:
    paths = tracked("--", *(f":(glob){pattern}" for pattern in patterns))
    return [path.read_text(encoding="utf-8") for path in paths]


def sources() -> list[str]:
    return texts("src/**/*.py")


def lines(found: list[str]) -> int:
    return sum(text.count("\n") for text in found)


def declared(kind: str) -> int:
    return sum(len(re.findall(rf"^@{kind}\(", text, re.MULTILINE)) for text in sources())


MEASURES = {
    "lines of src": lambda: lines(sources()),
    "lines of tests": lambda: lines(texts("tests/**/*.py")),
    "words of documentation": lambda: sum(len(text.split()) for text in texts(*PAGES)),
    "tables": lambda: declared("table"),
    "figures": lambda: declared("figure"),
    "experiments": lambda: declared("experiment"),
}


@pytest.mark.parametrize("what", LIMITS)
def test_no_limit_is_exceeded(what: str) -> None:
    assert MEASURES[what]() <= LIMITS[what]
