"""The article: paper and supplement as pages, and those of tables, figures and claims."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.artifact.artifact import Artifact
from pdrom.artifact.reads import Given, ProjectFile, Setting
from pdrom.core.paths import ARTICLE
from pdrom.core.store import read_table, read_text, write_text
from pdrom.report.article.claims import claims_page
from pdrom.report.article.latex import Origins, linked_table, prepared
from pdrom.report.article.pandoc import Tree, page, parsed
from pdrom.report.article.pictures import copies_pdf, shown_figure, write_pdf, write_picture
from pdrom.report.article.tables import FACTS, contents, list_page, table_page
from pdrom.report.article.tree import Labels, numbered, resolved
from pdrom.report.article.verified import INDEX, write_verified
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.report.paper.build import NUMBERS, Facts, fact_tables
from pdrom.report.paper.source import DOCUMENTS, documents
from pdrom.tables import declared
from pdrom.tables.claims.rules import load_claims

FOLDER = Path("src/pdrom/report/article")
CLAIMS = "config/claims.yaml"
ASSETS = {
    "text": "article.html",
    "plain": "plain.html",
    "table": "table.html",
    "style": "article.css",
    "script": "article.js",
}
# Pages of the documents by the name of their source.
PAGES = dict(zip(DOCUMENTS, (INDEX, "supplement.html"), strict=True))
TITLES = dict(zip(DOCUMENTS, ("Paper", "Supplement"), strict=True))
LINKS = {"tables.html": "Tables", "claims.html": "Claims", "live.html": "A model, running"}
_FIGURE = re.compile(r"\\figureof\{(\w+)\}")
_PREFIX = re.compile(r"\\renewcommand\{?\\thefigure\}?\{([A-Z]+)")


def write_article(
    source: list[str],
    references: str,
    tables: list[str],
    machine: str,
    inputs: list[str],
    figures: list[str],
    facts: Facts,
    claims: Path,
    assets: Mapping[str, Path],
    outputs: Mapping[str, str],
) -> None:
    """Write every page of the article to its place among ``outputs``.

    Parameters
    ----------
    source, references : TeX sources of the manuscript and its bibliography
    tables, machine : CSV of the tables and the record of the machine
    inputs : what the manuscript reads, with `NUMBERS`
    figures : PDF and PNG of each
    facts, claims : stated beside results, and the file of the claims' rules
    assets : templates, style and script by the names of `ASSETS`
    """
    made = {Path(path).name: path for path in inputs}
    origins = Origins(**json.loads(read_text(made[NUMBERS])))
    known = fact_tables(Path(machine), facts)
    csv = contents(tables, known)
    known |= {Path(path).stem: read_table(path) for path in tables}
    for name, content in csv.items():
        text = table_page(name, content, assets["table"].read_text("utf-8"))
        write_text(text, outputs[f"table_{name}"])
    plain = assets["plain"].read_text("utf-8")
    write_text(list_page(sorted(csv), plain), outputs["tables"])
    for name in ("style", "script"):
        write_text(assets[name].read_text("utf-8"), outputs[name])
    texts = documents(Path(source[0]).parent)
    pages = _figure_pages(texts)
    sizes = _write_figures(figures, outputs)
    rules = load_claims(claims)
    found = claims_page(rules, known["claims_tests"], known["claims"], pages, plain)
    write_text(found, outputs["claims"])
    files = _linked_inputs(made, origins, known)
    labels: dict[str, tuple[str, str]] = {}
    trees: dict[str, Tree] = {}
    for stem, text in texts.items():
        tex = prepared(text, stem, origins, facts)
        prefix = _PREFIX.search(text)
        counted = Labels(prefix[1] if prefix else "", PAGES[stem], labels)
        trees[stem] = numbered(
            parsed(tex, files, Path(references)),
            counted,
            lambda name, node: shown_figure(name, node, *sizes[name], pages),
        )
    for stem, tree in trees.items():
        others = {PAGES[other]: TITLES[other] for other in texts if other != stem}
        write_text(
            page(resolved(tree, labels, rules), assets["text"], _variables(others, facts)),
            outputs[stem],
        )
    write_verified({}, Path(outputs["main"]).parent)


def _figure_pages(texts: Mapping[str, str]) -> dict[str, str]:
    return {name: PAGES[stem] for stem, text in texts.items() for name in _FIGURE.findall(text)}


def _write_figures(
    figures: list[str], outputs: Mapping[str, str]
) -> dict[str, tuple[tuple[int, int], bool]]:
    """Write pictures and PDF files; return the size of each, and whether it has a PDF here."""
    found = {}
    for name in sorted({Path(path).stem for path in figures}):
        pdf, png = (
            next(Path(p) for p in figures if Path(p).name == f"{name}.{end}")
            for end in ("pdf", "png")
        )
        size = write_picture(png, Path(outputs[f"picture_{name}"]))
        with_pdf = copies_pdf(pdf)
        if with_pdf:
            write_pdf(pdf, Path(outputs["main"]).parent / "figures" / pdf.name)
        found[name] = size, with_pdf
    return found


def _linked_inputs(
    made: Mapping[str, str], origins: Origins, tables: Mapping[str, pd.DataFrame]
) -> dict[str, str]:
    """TeX tables by file name, their numbers with links to rows."""
    return {
        f"{name}.tex": linked_table(
            read_text(made[f"{name}.tex"]), {table: tables[table] for table in read}
        )
        for name, read in origins.tables.items()
    }


def _variables(others: Mapping[str, str], facts: Facts) -> dict[str, str]:
    nav = [f'<a href="{address}">{words}</a>' for address, words in {**others, **LINKS}.items()]
    return {"pages": " ".join(nav), **({"part": facts.part} if facts.part else {})}


class _Article(Artifact):
    """Many files of one folder."""

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Write all of them."""
        given = self.read(settings, inputs)
        assets = {name: given.pop(name) for name in ASSETS}
        self.function(**given, assets=assets, outputs=outputs)


def _writes() -> dict[str, Any]:
    names = {**PAGES, "tables": "tables.html", "claims": "claims.html"}
    names |= {"style": "article.css", "script": "article.js"}
    names |= {f"table_{name}": f"tables/{name}.html" for name in (*declared(), *FACTS)}
    names |= {f"picture_{name}": f"figures/{name}.webp" for name in declarations()}
    return {key: ARTICLE.where(name=name) for key, name in names.items()}


article = _Article(
    "article",
    "The manuscript as a page",
    {
        **dict.fromkeys(
            ("source", "references", "tables", "machine", "inputs", "figures"), Given()
        ),
        "claims": ProjectFile(CLAIMS),
        **{name: ProjectFile(str(FOLDER / file)) for name, file in ASSETS.items()},
        "facts": Setting("facts"),
    },
    _writes(),
    write_article,
)
