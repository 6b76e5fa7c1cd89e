"""The manifest that a codechecker reads, written from the declarations of figures and tables.

Format: https://codecheck.org.uk/spec/config/1.0/. What only the codechecker knows is left empty.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from pdrom.core.paths import FIGURE, RESULTS, TABLE
from pdrom.core.yamlfile import read_yaml
from pdrom.report.figure_numbers import Numbers, figure_numbers
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.report.words.markup import to_plain
from pdrom.tables.declaration import Table

FILE = Path("codecheck.yml")
HEAD = """\
# Written by: .venv/bin/python -m pdrom.pipeline.tables
# A codechecker runs ./reproduce, compares the files below (./reproduce verify),
# and fills in what is empty.
"""
_TITLE = re.compile(r"\\title\{([^\\}]*)")


def codecheck(tables: Iterable[Table[Any]]) -> str:
    """Content of ``codecheck.yml``, in the folder of the project."""
    title = _TITLE.search(Path("paper/main.tex").read_text(encoding="utf-8"))
    assert title, "the manuscript has no title"
    authors = [{"name": each["name"]} for each in read_yaml(Path("CITATION.cff"))["authors"]]
    numbers = figure_numbers(Path())
    figures = [
        _entry(FIGURE.at(RESULTS, name=name), _label(name, numbers[name]), declared.title)
        for name, declared in declarations().items()
    ]
    made = [_entry(TABLE.at(RESULTS, name=t.name), f"Table {t.name}", t.title) for t in tables]
    content = {
        "version": "https://codecheck.org.uk/spec/config/1.0/",
        "paper": {"title": title[1], "authors": authors, "reference": None},
        "manifest": [{"file": "paper/main.pdf", "comment": "The manuscript"}, *figures, *made],
        "codechecker": [{"name": None, "ORCID": None}],
        "report": None,
        "repository": None,
        "certificate": None,
        "check_time": None,
        "summary": None,
    }
    return HEAD + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110)


def _entry(file: str, label: str, title: str) -> dict[str, str]:
    return {"file": file, "comment": f"{label}: {to_plain(title)}"}


def _label(name: str, numbers: Numbers) -> str:
    return f"Figure {name} ({numbers.words})" if numbers.words else f"Figure {name}"
