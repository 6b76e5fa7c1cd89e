"""Everything that the study shows, with the rule that makes it and the command for it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from study.artifact.markup import to_plain
from study.artifact.paths import FIGURE, RESULTS, TABLE
from study.figures.kit.declaration import declarations
from study.paper.macros import keys_of
from study.paper.source import source_files
from study.pipeline.figure_command import PREPRINT
from study.pipeline.folders import Folders
from study.tables import declared
from study.tables.claims import load_claims
from study.tables.claims.metrics import METRICS

CLAIMS = "claims"
TITLE = re.compile(r"\\section\{([^{}]*)\}")


@dataclass(frozen=True)
class Entry:
    """A line of the map.

    kind : claim, figure, table, section (numbers of the text) or manuscript
    rule : rule of the workflow that makes it
    files : its files, of the default configuration
    words : arguments of ./reproduce that make them
    rests_on : figures and tables that a claim is seen in and decided by, tables of a section
    """

    kind: str
    name: str
    title: str
    rule: str
    files: tuple[str, ...]
    words: tuple[str, ...]
    rests_on: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, str]:
        """Key that distinguishes it from the others."""
        return self.kind, self.name


def entries(root: Path = Path()) -> list[Entry]:
    """Claims, figures (the preprint's first), tables, sections, manuscript; read from ``root``."""
    return [*_claims(root), *_figures(), *_tables(), *_sections(root), _manuscript()]


def table_words(name: str) -> str:
    """Argument that makes the table ``name`` and nothing else."""
    return TABLE.at(RESULTS, name=name) if name in declarations() else name


def _claims(root: Path) -> Iterator[Entry]:
    for name, claim in load_claims(root / "config" / "claims.yaml").items():
        tests = (*claim.published, *claim.beyond)
        tables = dict.fromkeys(METRICS[test.metric].table for test in tests)
        yield Entry(
            kind="claim",
            name=name,
            title=claim.paper,
            rule=f"{CLAIMS}_table",
            files=(TABLE.at(RESULTS, name=CLAIMS),),
            words=(CLAIMS,),
            rests_on=tuple(dict.fromkeys([claim.figure_or_table, *tables])),
        )


def _figures() -> Iterator[Entry]:
    for name, figure in declarations().items():
        yield Entry(
            kind="figure",
            name=name,
            title=to_plain(figure.title),
            rule=f"figure_{name}",
            files=(FIGURE.at(RESULTS, name=name),),
            words=("figure", f"{PREPRINT}{figure.number}" if figure.number else name),
        )


def _tables() -> Iterator[Entry]:
    for name, table in declared().items():
        file = TABLE.at(RESULTS, name=name)
        rule = f"{name}_table"
        yield Entry("table", name, table.title, rule, (file,), (table_words(name),))


def _sections(root: Path) -> Iterator[Entry]:
    r"""Sections of the manuscript that hold numbers (``\val``), with their tables."""
    for path in source_files(root):
        text = (root / path).read_text(encoding="utf-8")
        held = sorted({key.partition("|")[0] for key in keys_of(text)} & declared().keys())
        found = TITLE.search(text)
        if held:
            yield Entry(
                kind="section",
                name=Path(path).stem,
                title=_section(found[1] if found else "Abstract", Path(path)),
                rule="paper_inputs",
                files=tuple(TABLE.at(RESULTS, name=name) for name in held),
                words=tuple(map(table_words, held)),
                rests_on=tuple(held),
            )


def _section(title: str, path: Path) -> str:
    return f"{title} (supplement)" if path.parent.name == "supplement" else title


def _manuscript() -> Entry:
    files = tuple(Folders().documents.values())
    return Entry("manuscript", files[0], "The manuscript and all of the above", "paper", files, ())
