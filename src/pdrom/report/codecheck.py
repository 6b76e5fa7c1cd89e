"""The manifest that a codechecker reads, written from the declarations of figures and tables.

Format: https://codecheck.org.uk/spec/config/2.0/, of 11 September 2026. What only the codechecker
knows is left empty; so is an ORCID, which the format asks for, of an author who has none.
"""

import re
from collections.abc import Iterable
from pathlib import Path

import yaml
from pybtex.database import parse_file
from pybtex.richtext import Text

from pdrom.core.paths import FIGURE, RESULTS, TABLE
from pdrom.core.yamlfile import read_yaml
from pdrom.report.figure_numbers import figure_numbers
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.report.words.markup import to_plain
from pdrom.tables.kit.declaration import Table

FILE = Path("codecheck.yml")
SPECIFICATION = "https://codecheck.org.uk/spec/config/2.0/"
BIBLIOGRAPHY, PREPRINT = Path("paper/references.bib"), "Monem25DEIM"
ORCID = "https://orcid.org/"  # how CITATION.cff begins one
HEAD = """\
---
# Written by: ./reproduce pages
# A codechecker runs ./reproduce, compares the files below (./reproduce verify),
# and fills in what is empty.
"""
DOCUMENTS = (
    {"file": "paper/main.pdf", "comment": "The manuscript"},
    {"file": "paper/supplement.pdf", "comment": "Supplement of the manuscript"},
)
_TITLE = re.compile(r"\\title\{([^\\}]*)")


def codecheck(tables: Iterable[Table]) -> str:
    """Content of ``codecheck.yml``, in the folder of the project, with all ``tables``."""
    title = _TITLE.search(Path("paper/main.tex").read_text(encoding="utf-8"))
    assert title, "the manuscript has no title"
    authors = [_author(each) for each in read_yaml(Path("CITATION.cff"))["authors"]]
    numbers = figure_numbers(Path())
    figures = [
        _entry(FIGURE.at(RESULTS, name=name), f"Figure {numbers[name].label(name)}", declared.title)
        for name, declared in declarations().items()
    ]
    made = [_entry(TABLE.at(RESULTS, name=t.name), f"Table {t.name}", t.title) for t in tables]
    content = {
        "version": SPECIFICATION,
        "paper": {"title": title[1], "authors": authors, "reference": _preprint()},
        "manifest": [*DOCUMENTS, *figures, *made],
        "codechecker": [{"name": None, "ORCID": None}],
        "report": None,
        "repository": None,
        "certificate": None,
        "check_time": None,
        "summary": None,
    }
    return HEAD + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110)


def _author(entry: dict[str, str]) -> dict[str, str]:
    known = {"ORCID": entry["orcid"].removeprefix(ORCID)} if "orcid" in entry else {}
    return {"name": entry["name"], **known}


def _preprint() -> str:
    """The paper that is rebuilt, in words: it has no address that lasts."""
    entry = parse_file(str(BIBLIOGRAPHY)).entries[PREPRINT]
    people = (
        [*each.first_names, *each.middle_names, *each.prelast_names, *each.last_names]
        for each in entry.persons["author"]
    )
    authors = ", ".join(" ".join(names) for names in people)
    title, note = (str(Text.from_latex(entry.fields[key])) for key in ("title", "note"))
    return f"{authors}: {title}. {note}"


def _entry(file: str, label: str, title: str) -> dict[str, str]:
    return {"file": file, "comment": f"{label}: {to_plain(title)}"}
