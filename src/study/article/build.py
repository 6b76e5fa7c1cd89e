"""Build the article: web pages with the text of paper and supplement, all tables, all claims."""

import base64
import gzip
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from html import escape
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
from PIL import Image

from pdrom.core.errors import PaperError
from pdrom.core.store import atomic_path, read_text, require_intact, write_text
from pdrom.view.page import filled, safe_json
from study.article.latex import linked_table, prepared
from study.article.tree import Labels, Node, attributes, boxed, numbered, plain, resolved, words
from study.artifact.artifact import Artifact
from study.artifact.paths import ARTICLE, FIGURE_PICTURE, RESULTS, TABLE, File
from study.artifact.reads import Every, ProjectFile, Setting, TableOf
from study.figures.kit.declaration import declarations
from study.paper.build import NUMBERS, Facts, fact_tables, paper, paper_inputs, shown_tables
from study.paper.source import DOCUMENTS, PLACED, documents
from study.paper.textables import tex_rows
from study.tables import declared
from study.tables.claims.metrics import METRICS
from study.tables.claims.rules import Added, ClaimRule, TestRule, load_claims
from study.tables.kit.declaration import QUANTITIES, TOLERANCES

# Bytes: larger pictures are compressed with losses; larger PDFs are not copied to the web pages.
LOSSLESS, COPIED = 150_000, 200_000
Drawn = Mapping[str, tuple[tuple[int, int], bool]]  # figure -> size in pixels, and has it a PDF?


def shown_figure(name: str, node: Node, drawn: Drawn, known: Collection[str]) -> Node:
    """Return a figure as a node of pandoc's syntax tree: picture, caption, shell command, links.

    ``node`` is the figure as pandoc parsed it, ``known`` has the names of all tables with a page.
    """
    (width, height), with_pdf = drawn[name]
    (attribute, caption, _), picture = node["c"], f"figures/{name}.webp"
    size = attributes("", "", width=str(width), height=str(height), loading="lazy")
    # a single text node, because pandoc hides a caption that has the nodes of the alternative text
    alternative = words(plain(caption[1]).strip())
    image = {"t": "Image", "c": [size, alternative, [picture, ""]]}
    origin = {"t": "RawBlock", "c": ["html", _origin(name, with_pdf, known)]}
    told = [caption[0], [*caption[1], boxed("Div", [origin], "", "origin")]]
    opened = {"t": "Link", "c": [attributes(), [image], [picture, ""]]}
    return {"t": "Figure", "c": [attribute, told, [{"t": "Plain", "c": [opened]}]]}


def _origin(name: str, with_pdf: bool, known: Collection[str]) -> str:
    """Return HTML: shell command that makes a figure, and links to its tables and its PDF."""
    reads = declarations()[name].reads.values()
    tables = [r.name for r in reads if isinstance(r, TableOf) and r.name in known]
    data = ", ".join(f'<a href="tables/{table}.html">{table}</a>' for table in tables)
    pdf = f'<a href="figures/{name}.pdf">PDF</a>. ' if with_pdf else ""
    return (
        f"Command: <code>./reproduce figure {name}</code>. "
        f"{f'Data: {data}.' if tables else 'Drawn from files of simulations.'} {pdf}"
        f'Last <code>./reproduce verify</code>: <span data-verified="figure {name}">not run</span>.'
    )


FACTS = {
    "study": "Settings of the study that the paper states",
    "methods": "Reduction methods of the configuration",
    "scenes": "Scenes of the configuration",
    "machine": "Machine on which the study ran",
}
PARTS = {"published": "Preprint's method", "beyond": "Improved method"}
VERIFIED, INDEX = "verified.js", "index.html"


def table_page(name: str, csv: bytes, template: str) -> str:
    """Return the page of table ``name``: rows (``csv``), shell command, meanings of columns."""
    table, marked = declared().get(name), partial(re.sub, r"`([^`]*)`", r"<code>\1</code>")
    columns = "".join(
        f"<tr data-column='{c.name}'><th scope=row>{c.name}</th>"
        f"<td>{marked(escape(c.meaning))}</td><td>{escape(c.unit)}</td>"
        f"<td>{c.quantity}</td>"
        f"<td>{f'{c.within:g}' if c.quantity in TOLERANCES else 'not compared'}</td></tr>"
        for c in (table.columns if table else ())
    )
    kinds = {c.quantity: QUANTITIES[c.quantity] for c in (table.columns if table else ())}
    parts = {
        "NAME": name,
        "TITLE": escape(titles()[name]),
        "COMMAND": escape(f"./reproduce {argument(name)}"),
        "COLUMNS": columns or "<tr><td colspan=5>facts that verify does not compare</td></tr>",
        "KINDS": "".join(f"<p><strong>{k}</strong>: {escape(v)}.</p>" for k, v in kinds.items()),
        "DATA": base64.b64encode(gzip.compress(csv, 9, mtime=0)).decode(),
    }
    return filled(template, parts)


def titles() -> dict[str, str]:
    """Return name -> title of all tables that may have a page."""
    return FACTS | {name: table.title for name, table in declared().items()}


def argument(name: str) -> str:
    """Return the argument with which ``./reproduce`` makes table ``name`` (result or fact)."""
    if name in FACTS:
        return "paper_inputs"
    return TABLE.at(RESULTS, name=name) if name in declarations() else name


def claims_page(
    claims: Mapping[str, ClaimRule], tests: pd.DataFrame, verdicts: pd.DataFrame,
    pages: Mapping[str, str], template: str,
) -> str:  # fmt: skip
    """Return the text of the page of all ``claims`` (name -> rule), their tests and verdicts.

    pages : name of a figure -> file name of the page that shows it
    """
    body, section, end = template.split("<!-- each claim -->\n")
    found = verdicts.set_index("claim").replace("depends", "mixed")
    for name, rule in claims.items():
        mine, shown = tests[tests.claim == name].replace("depends", "mixed"), rule.figure_or_table
        history = "".join(
            f"<li>{c.date} ({'results were known' if c.after_data else 'before any result'}): "
            f"{escape(c.reason)}</li>"
            for c in rule.changes
        )
        texts = rule.model_dump() | dict(found.loc[name])
        parts = {key.upper(): escape(str(text)) for key, text in texts.items()} | {
            "NAME": name, "SHOWN": shown, "HISTORY": history, "FINGERPRINT": rule.fingerprint,
            "FIGURES": "" if rule.shown == "none" else f", figures: {escape(rule.shown)}",
            "KIND": "figure" if shown in pages else "table",
            "PLACE": f"{pages[shown]}#fig:{shown}" if shown in pages else f"tables/{shown}.html",
            "TESTS": "".join(_tests(name, part, getattr(rule, part), mine) for part in PARTS),
        }  # fmt: skip
        body += filled(section, parts)
    return body + end


def _tests(name: str, part: str, rules: tuple[TestRule, ...], tests: pd.DataFrame) -> str:
    rows = "<tr><th>test</th><th>rule</th><th>agreeing rows</th><th>result, range, median</th></tr>"
    place = f"tables/claims_tests.html#claim={name}|part={part}|satisfied"
    for rule, row in zip(rules, tests[tests.part == part].itertuples(), strict=True):
        note = "" if rule.decides else " (does not decide the verdict)"
        low, middle, high = (f"{float(f'{v:.2g}'):g}" for v in (row.least, row.median, row.most))
        spread = f"; {low} to {high}, median {middle}".replace("inf", "\u221e")
        rows += (
            f"<tr><td>{escape(rule.what)}{note}</td><td>{_rule(rule)}</td>"
            f"<td><a class=val href='{place}'>{row.satisfied} of {row.of}</a></td>"
            f"<td>{escape(row.verdict)}{'' if pd.isna(row.least) else spread}</td></tr>"
        )
    region = f"class=scroll tabindex=0 role=region aria-label='Tests of {name}, {part}'"
    return f"<h3>{PARTS[part]}</h3><div {region}><table>{rows}</table></div>"


def _rule(rule: TestRule) -> str:
    table = METRICS[rule.metric].table
    where = "; ".join(
        f"{column}: {', '.join(map(str, values))}" for column, values in rule.where.items()
    )
    margin = f"; undecided within a factor of {rule.factor:g} of the limit" if rule.timed else ""
    return (
        f"<code>{rule.metric}</code> of table <a href='tables/{table}.html'>{table}</a>"
        f"{f' ({escape(where)})' if where else ''} "
        f"is {'at least' if rule.compare == '>=' else 'at most'} {rule.threshold:g} "
        f"in at least {100 * rule.share:g} % of the rows{margin}"
    )


def write_verified(found: Mapping[str, str], folder: Path) -> None:
    """Write the results of ``./reproduce verify`` to a script in ``folder`` that all pages load.

    ``found`` maps kind and name of an output, such as "table payoff", to the result of its check.
    """
    write_text(f"window.pdromVerified={safe_json(dict(found))};\n", folder / VERIFIED)


FOLDER = Path("src/study/article")
ASSETS = {
    "text": "article.html",
    "frame": "plain.html",
    "list": "tables.html",
    "page": "claims.html",
    "table": "table.html",
    "style": "article.css",
    "script": "article.js",
}
# Name of a TeX source -> file name of its web page.
PAGES = dict(zip(DOCUMENTS, (INDEX, "supplement.html"), strict=True))
TITLES = dict(zip(DOCUMENTS, ("Paper", "Supplement"), strict=True))
# Page -> title, and the rule without which the page does not exist.
LINKS = {
    "tables.html": ("Tables", ""),
    "claims.html": ("Claims", "claims_table"),
    "live.html": ("Interactive models", "live_page"),
}
_PREFIX = re.compile(r"\\renewcommand\{?\\thefigure\}?\{([A-Z]+)")


def write_article(
    source: list[Path], references: Path, tables: list[File], machine: File, inputs: list[File],
    figures: list[File], pictures: list[File], facts: Facts, claims: Path, added: Added,
    made: list[str], outputs: Mapping[str, str], **assets: Path,
) -> None:  # fmt: skip
    """Write all pages of the article to ``outputs`` (name of a page or file -> path).

    inputs : generated files that the manuscript includes; numbers.json: table cells of its numbers
    figures, pictures : PDF and PNG of each figure
    made : names of the rules of all tables, figures and pages of the study
    claims, added : see `load_claims`
    assets : templates, style and script (files of `ASSETS`)
    """
    (numbers,) = (file.path for file in inputs if file["name"] == NUMBERS)
    origins = json.loads(read_text(numbers))
    data, hidden = shown_tables(tables)
    known = fact_tables(Path(machine.path), facts) | data
    csv = {table["name"]: Path(table.path).read_bytes() for table in tables}
    for name in known if hidden else FACTS:
        csv[name] = known[name].to_csv(index=False, lineterminator="\n").encode()
    texts = documents(source[0].parent)
    pages = {
        name: PAGES[stem]
        for stem, text in texts.items()
        for name in PLACED.findall(text)
        if f"picture_{name}" in outputs
    }
    linked = {page: words for page, (words, rule) in LINKS.items() if rule in (*made, "")}
    written = {name: path.read_text("utf-8") for name, path in assets.items()}
    frame = written.pop("frame").replace("{{LINKS}}", _links(linked))
    claimed = written.pop("page")
    of_table = written.pop("table").replace("{{LINKS}}", _links(linked, "../"))
    rules = load_claims(claims, added)
    for name, content in csv.items():
        written[f"table_{name}"] = table_page(name, content, of_table)
    items = "".join(
        f"<li><a href='tables/{name}.html'><code>{name}</code></a>: {escape(titles()[name])}</li>"
        for name in sorted(csv)
    )
    items = filled(written.pop("list"), {"BODY": items})
    written["tables"] = filled(frame, {"TITLE": "Tables", "BODY": items})
    if "claims" in outputs:
        body = claims_page(rules, known["claims_tests"], known["claims"], pages, claimed)
        written["claims"] = filled(frame, {"TITLE": "Claims", "BODY": body})
    drawn = _write_figures(figures, pictures, outputs)
    files = {
        f"{name}.tex": linked_table(tex_rows(name, known), {table: known[table] for table in read})
        for name, read in origins["tables"].items()
    }
    labels: dict[str, tuple[str, str]] = {}
    trees: dict[str, Node] = {}
    for stem, text in texts.items():
        prefix = _PREFIX.search(text)
        counters = Labels(prefix[1] if prefix else "", PAGES[stem], labels)
        tree = parsed(prepared(text, stem, origins, facts), files, references)
        shown = partial(shown_figure, drawn=drawn, known=csv)
        trees[stem] = numbered(tree, counters, shown)
    del written["text"]
    addresses = {claim: f"claims.html#{claim}" for claim in rules}
    addresses |= {name: f"tables/{name}.html" for name in csv}
    for stem, tree in trees.items():
        others = {PAGES[other]: TITLES[other] for other in texts if other != stem}
        variables = {"pages": _links(others | linked), "part": escape(facts.part or "")}
        written[stem] = page(resolved(tree, labels, addresses), assets["text"], variables)
    for name, text in written.items():
        write_text(text, outputs[name])
    write_verified({}, Path(outputs["main"]).parent)


def _links(pages: Mapping[str, str], above: str = "") -> str:
    """Return HTML links to ``pages`` (address -> words); ``above``: path to the folder of pages."""
    return " ".join(f'<a href="{above}{page}">{words}</a>' for page, words in pages.items())


def _write_figures(figures: list[File], pictures: list[File], outputs: Mapping[str, str]) -> Drawn:
    """Write each figure as WebP, and as PDF if that is small."""
    png = {picture["name"]: Path(picture.path) for picture in pictures}
    made = {}
    for name, pdf in sorted((figure["name"], Path(figure.path)) for figure in figures):
        require_intact(png[name])
        require_intact(pdf)
        with Image.open(png[name]) as image:
            drawn = image.convert("RGB")
        with atomic_path(outputs[f"picture_{name}"]) as temporary:
            drawn.save(temporary, "WEBP", lossless=True, method=3)
            if temporary.stat().st_size > LOSSLESS:
                drawn.save(temporary, "WEBP", quality=85, method=4)
        if small := pdf.stat().st_size <= COPIED:
            with atomic_path(Path(outputs["main"]).parent / "figures" / pdf.name) as temporary:
                shutil.copyfile(pdf, temporary)
        made[name] = (drawn.size, small)
    return made


WRITES = {
    **PAGES, "tables": "tables.html", "claims": "claims.html", "style": "article.css",
    "script": "article.js",
    **{f"table_{name}": f"tables/{name}.html" for name in (*declared(), *FACTS)},
    **{f"picture_{name}": f"figures/{name}.webp" for name in declarations()},
}  # fmt: skip
LIMIT = 300.0  # time limit of pandoc, s, since a TeX definition that expands to itself never ends


def parsed(text: str, files: Mapping[str, str], references: Path) -> Node:
    r"""Return pandoc's syntax tree of the LaTeX source ``text`` and of its bibliography.

    ``files`` maps names of the files that the source reads by ``\input`` to contents. Raises
    PaperError if pandoc is not installed, or if it rejects the source.
    """
    with tempfile.TemporaryDirectory(prefix="pdrom-pandoc-") as folder:
        for name, content in {**files, "article.tex": text}.items():
            Path(folder, name).write_text(content, encoding="utf-8")
        words = ["-f", "latex", "-t", "json", "--citeproc", "-M", "link-citations=true"]
        words += ["--bibliography", str(references.resolve()), "article.tex"]
        return dict(json.loads(_run(words, folder, "")))


def page(tree: Node, template: Path, variables: Mapping[str, str]) -> str:
    """Return the HTML page that pandoc makes of ``tree`` by its ``template`` and ``variables``."""
    words = ["-f", "json", "-t", "html5", "--mathml", "--wrap=none", "--toc", "--toc-depth=2"]
    words += ["--standalone", "--shift-heading-level-by=1", f"--template={template.resolve()}"]
    words += [word for name, value in variables.items() for word in ("-V", f"{name}={value}")]
    return _run(words, None, json.dumps(tree))


def _run(words: Sequence[str], folder: str | None, given: str) -> str:
    spec = find_spec("pypandoc")
    program = Path(spec.origin or "").parent / "files" / "pandoc" if spec else None
    if program is None or not program.is_file():
        raise PaperError("no pandoc: package pypandoc-binary is missing; install requirements.lock")
    command = [str(program), "--quiet", *words]
    try:
        done = subprocess.run(
            command, input=given, cwd=folder, capture_output=True, encoding="utf-8",
            timeout=LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise PaperError(f"pandoc did not end in {LIMIT:g} s; does a macro call itself?") from error
    if done.returncode != 0:
        raise PaperError(f"pandoc rejects the text: {' '.join(done.stderr.split())[:300]}")
    return done.stdout


article = Artifact(
    "article",
    "Manuscript as web pages",
    {
        **paper_inputs.reads,
        **paper.reads,
        "pictures": Every(FIGURE_PICTURE),
        "claims": ProjectFile("config/claims.yaml"),
        **{name: ProjectFile(str(FOLDER / file)) for name, file in ASSETS.items()},
        "added": Setting("claim_sets"),
    },
    {key: ARTICLE.where(name=name) for key, name in WRITES.items()},
    write_article,
)
