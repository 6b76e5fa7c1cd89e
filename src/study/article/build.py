"""The article: paper and supplement as pages, and those of tables, figures and claims."""

import io
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from html import escape
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
from PIL import Image

from pdrom.core.errors import PaperError
from pdrom.core.store import atomic_path, read_table, read_text, require_intact, write_text
from study.article.latex import Origins, linked_table, prepared
from study.article.tables import FACTS, claims_page, contents, list_page, table_page
from study.article.tree import (
    Labels,
    Node,
    Tree,
    attributes,
    link,
    numbered,
    plain,
    resolved,
    words,
)
from study.article.verified import INDEX, write_verified
from study.artifact.artifact import Files
from study.artifact.paths import ARTICLE, FIGURE_PICTURE, File, Place
from study.artifact.reads import Every, ProjectFile, Setting, TableOf
from study.figures.kit.declaration import declarations
from study.paper.build import NUMBERS, Facts, fact_tables, paper, paper_inputs
from study.paper.source import DOCUMENTS, documents
from study.tables import declared
from study.tables.claims.rules import Added, load_claims

# Bytes: a larger picture loses what nobody sees; a larger PDF is left to the command.
LOSSLESS, COPIED = 150_000, 200_000
MANY = 4  # keys of options that say what is drawn


def write_picture(png: Path, out: Path) -> tuple[int, int]:
    """Write the picture ``png`` of a figure as WebP ``out``; return width and height, pixels."""
    require_intact(png)
    with Image.open(png) as image:
        drawn = image.convert("RGB")
    packed = io.BytesIO()
    drawn.save(packed, "WEBP", lossless=True, method=3)
    if packed.tell() > LOSSLESS:
        packed = io.BytesIO()
        drawn.save(packed, "WEBP", quality=85, method=4)
    with atomic_path(out) as temporary:
        temporary.write_bytes(packed.getvalue())
    return drawn.size


def copy_pdf(pdf: Path, out: Path) -> bool:
    """Copy a figure's ``pdf`` to ``out`` where it is small; whether it is."""
    require_intact(pdf)
    small = pdf.stat().st_size <= COPIED
    if small:
        with atomic_path(out) as temporary:
            shutil.copyfile(pdf, temporary)
    return small


def shown_figure(
    name: str, node: Node, size: tuple[int, int], with_pdf: bool, pages: Mapping[str, str]
) -> Node:
    """A figure with its picture, the caption as its words, its command, data, PDF and kin.

    Parameters
    ----------
    node : of the figure in the syntax tree
    size : of the picture, pixels
    with_pdf : whether its PDF lies beside the page
    pages : of the figures that stand in the documents, by name
    """
    attribute, caption, _ = node["c"]
    inlines = [attributes("", "", width=str(size[0]), height=str(size[1]), loading="lazy")]
    alternative = words(plain(caption[1]).strip())
    image = {"t": "Image", "c": [*inlines, alternative, [f"figures/{name}.webp", ""]]}
    lines = {"t": "Div", "c": [attributes("", "origin"), [_para(_origin(name, with_pdf, pages))]]}
    return {"t": "Figure", "c": [attribute, [caption[0], [*caption[1], lines]], [_para([image])]]}


def _para(inlines: list[Node]) -> Node:
    return {"t": "Plain", "c": inlines}


def _origin(name: str, with_pdf: bool, pages: Mapping[str, str]) -> list[Node]:
    declared = declarations()[name]
    tables = [read.name for read in declared.reads.values() if isinstance(read, TableOf)]
    made = [*words("Command: "), {"t": "Code", "c": [attributes(), f"./reproduce figure {name}"]}]
    made += words(". Data: " if tables else ". Drawn from the runs themselves")
    for place, table in enumerate(tables):
        made += [*words(", " if place else ""), link(words(table), f"tables/{table}.html")]
    made += words(". ")
    if with_pdf:
        made += [link(words("PDF"), f"figures/{name}.pdf"), *words(". ")]
    for place, other in enumerate(_kin(name, pages)):
        made += words(", " if place else "Other scenes: ")
        made.append(link(words(other), f"{pages[other]}#fig:{other}", "kin"))
    if made[-1]["t"] == "Link":
        made += words(".")
    mark = {
        "t": "Span",
        "c": [attributes("", "", data_verified=f"figure {name}"), words("not yet")],
    }
    return [*made, *words(" Last verification: "), mark, *words(".")]


def _kin(name: str, pages: Mapping[str, str]) -> list[str]:
    """Names of figures that show the same of other scenes.

    They share the type of their options, where that has many keys, or their name.
    """
    listed = declarations()
    mine = listed[name].options
    return [
        other
        for other, declared in listed.items()
        if other in pages
        and other != name
        and (
            (declared.options is mine and len(mine.model_fields) >= MANY)
            or other.startswith(f"{name}_")
            or name.startswith(f"{other}_")
        )
    ]


FOLDER = Path("src/study/article")
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
    source: list[Path],
    references: Path,
    tables: list[File],
    machine: File,
    inputs: list[File],
    figures: list[File],
    pictures: list[File],
    facts: Facts,
    claims: Path,
    added: Added,
    outputs: Mapping[str, str],
    **assets: Path,
) -> None:
    """Write every page of the article to its place among ``outputs``.

    Parameters
    ----------
    source, references : TeX sources of the manuscript and its bibliography
    tables, machine : CSV of the tables and the record of the machine
    inputs : what the manuscript reads, with `NUMBERS`
    figures, pictures : PDF and PNG of each figure
    facts, claims : facts that are no results, and the file of the claims' rules
    added : values that the study adds to sets of ``claims``, see `load_claims`
    assets : templates, style and script, see `ASSETS`
    """
    made = {file["name"]: file.path for file in inputs}
    origins = Origins(**json.loads(read_text(made[NUMBERS])))
    known = fact_tables(Path(machine.path), facts)
    csv = contents([table.path for table in tables], known)
    known |= {table["name"]: read_table(table.path) for table in tables}
    templates = {name: path.read_text("utf-8") for name, path in assets.items()}
    texts = documents(source[0].parent)
    pages = {name: PAGES[stem] for stem, text in texts.items() for name in _FIGURE.findall(text)}
    rules, plain = load_claims(claims, added), templates["plain"]
    written = {name: templates[name] for name in ("style", "script")}
    for name, content in csv.items():
        written[f"table_{name}"] = table_page(name, content, templates["table"])
    written["tables"] = list_page(sorted(csv), plain)
    written["claims"] = claims_page(rules, known["claims_tests"], known["claims"], pages, plain)
    drawn = _write_figures(figures, pictures, outputs)
    files = _linked_inputs(made, origins, known)
    labels: dict[str, tuple[str, str]] = {}
    trees: dict[str, Tree] = {}
    for stem, text in texts.items():
        tex = prepared(text, stem, origins, facts)
        prefix = _PREFIX.search(text)
        trees[stem] = numbered(
            parsed(tex, files, references),
            Labels(prefix[1] if prefix else "", PAGES[stem], labels),
            lambda name, node: shown_figure(name, node, *drawn[name], pages),
        )
    for stem, tree in trees.items():
        others = {PAGES[other]: TITLES[other] for other in texts if other != stem}
        whole = resolved(tree, labels, rules)
        written[stem] = page(whole, assets["text"], _variables(others, facts))
    for name, text in written.items():
        write_text(text, outputs[name])
    write_verified({}, Path(outputs["main"]).parent)


def _write_figures(
    figures: list[File], pictures: list[File], outputs: Mapping[str, str]
) -> dict[str, tuple[tuple[int, int], bool]]:
    """Write pictures and PDF files; return the size of each, and whether it has a PDF here."""
    folder = Path(outputs["main"]).parent / "figures"
    pdf = {figure["name"]: Path(figure.path) for figure in figures}
    png = {picture["name"]: Path(picture.path) for picture in pictures}
    return {
        name: (
            write_picture(png[name], Path(outputs[f"picture_{name}"])),
            copy_pdf(pdf[name], folder / f"{name}.pdf"),
        )
        for name in sorted(pdf)
    }


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
    return {"pages": " ".join(nav), **({"part": escape(facts.part)} if facts.part else {})}


def _writes() -> dict[str, Place]:
    names = {**PAGES, "tables": "tables.html", "claims": "claims.html"}
    names |= {"style": "article.css", "script": "article.js"}
    names |= {f"table_{name}": f"tables/{name}.html" for name in (*declared(), *FACTS)}
    names |= {f"picture_{name}": f"figures/{name}.webp" for name in declarations()}
    return {key: ARTICLE.where(name=name) for key, name in names.items()}


LIMIT = 300.0  # seconds; a definition that expands to itself never ends


def parsed(text: str, files: Mapping[str, str], references: Path) -> Tree:
    r"""Pandoc's syntax tree of a LaTeX source ``text``, with its bibliography.

    Parameters
    ----------
    files : what the source reads by ``\input``, by name
    references : BibTeX

    Raises
    ------
    PaperError
        Pandoc is not installed, or refuses the source.
    """
    with tempfile.TemporaryDirectory(prefix="pdrom-pandoc-") as folder:
        for name, content in {**files, "article.tex": text}.items():
            Path(folder, name).write_text(content, encoding="utf-8")
        words = ["-f", "latex", "-t", "json", "--citeproc", "-M", "link-citations=true"]
        words += ["--bibliography", str(references.resolve()), "article.tex"]
        tree: Tree = json.loads(_run(words, folder, ""))
        return tree


def page(tree: Tree, template: Path, variables: Mapping[str, str]) -> str:
    """HTML of ``tree`` by a ``template`` with ``variables``; PaperError as in `parsed`.

    Formulas are MathML, a table of contents comes first.
    """
    words = ["-f", "json", "-t", "html5", "--mathml", "--wrap=none", "--toc", "--toc-depth=2"]
    words += ["--standalone", "--shift-heading-level-by=1", f"--template={template.resolve()}"]
    words += [word for name, value in variables.items() for word in ("-V", f"{name}={value}")]
    return _run(words, None, json.dumps(tree))


def _run(words: Sequence[str], folder: str | None, given: str) -> str:
    spec = find_spec("pypandoc")
    program = Path(spec.origin or "").parent / "files" / "pandoc" if spec else None
    if program is None or not program.is_file():
        raise PaperError("no pandoc: the package pypandoc-binary of requirements.lock is missing")
    command = [str(program), "--quiet", *words]
    try:
        done = subprocess.run(
            command, input=given, cwd=folder, capture_output=True, encoding="utf-8",
            timeout=LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise PaperError(f"pandoc does not end within {LIMIT:g} s") from error
    if done.returncode != 0:
        raise PaperError(f"pandoc: {' '.join(done.stderr.split())[:300]}")
    return done.stdout


article = Files(
    "article",
    "The manuscript as a page",
    {
        **paper_inputs.reads,
        **paper.reads,
        "pictures": Every(FIGURE_PICTURE),
        "claims": ProjectFile(CLAIMS),
        **{name: ProjectFile(str(FOLDER / file)) for name, file in ASSETS.items()},
        "added": Setting("claim_sets"),
    },
    _writes(),
    write_article,
)
