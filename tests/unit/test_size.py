"""The size of the project: limits that a change may lower and never raise.

Counted in what git tracks. Where a change meets a limit, delete what has no reader.
"""

import ast
import re
from functools import cache

import pytest

from places import tracked

LIMITS = {
    "lines of src": 35_837,
    "modules of src": 213,
    "lines of tests": 22_707,
    "words of documentation": 24_547,
    "tables": 25,
    "figures": 23,
    "experiments": 19,
    "percent of src in decorators, signatures and imports": 17.96,
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


def formal_lines(node: ast.AST) -> int:
    """Lines of a node's decorators, its signature, or its import."""
    if isinstance(node, (ast.Import, ast.ImportFrom)):
        return node.end_lineno - node.lineno + 1
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        first = min(n.lineno for n in (node, *node.decorator_list))
        return max(node.body[0].lineno - first, 1)
    return 0


def formal_percent() -> float:
    formal = sum(formal_lines(node) for text in sources() for node in ast.walk(ast.parse(text)))
    return 100 * formal / lines(sources())


MEASURES = {
    "lines of src": lambda: lines(sources()),
    "modules of src": lambda: len(sources()),
    "lines of tests": lambda: lines(texts("tests/**/*.py")),
    "words of documentation": lambda: sum(len(text.split()) for text in texts(*PAGES)),
    "tables": lambda: declared("table"),
    "figures": lambda: declared("figure"),
    "experiments": lambda: declared("experiment"),
    "percent of src in decorators, signatures and imports": formal_percent,
}


@pytest.mark.parametrize("what", LIMITS)
def test_no_limit_is_exceeded(what: str) -> None:
    assert MEASURES[what]() <= LIMITS[what]
