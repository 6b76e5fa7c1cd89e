"""The article: every number equals that of the PDF and links to its rows, every page opens."""

import base64
import gzip
import io
import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe
from PIL import Image

from browser import page_at
from builders import frame
from pdrom.core.errors import PaperError, StorageError
from pdrom.core.machine import machine
from pdrom.core.store import atomic_path, write_table, write_text
from places import ROOT
from study.article.build import ASSETS, FACTS, FOLDER, PAGES, article, write_verified
from study.article.latex import linked_table
from study.artifact.paths import File
from study.experiments.machine import Record, Units
from study.paper import build, textables
from study.paper.numbers import AGGREGATES, MISSING, entries, format_number, matching
from study.paper.source import documents, figure_numbers
from study.paper.tex import find_pdflatex, packages_of

SPECIAL = r"""
\documentclass{article}
\input{preamble.tex}
\title{One?\\[2pt] \large Two\ifpart\\ Part\fi}
"""
MAIN = r"""
\begin{document}
\timesnote
\begin{abstract}\ifpart Of \configuration{}.\else Full.\fi\end{abstract}
% \section{Not there}
\section{First}\label{sec:first}
On \scene{bar\_a} it is \n{podError}\,\%, at most \n{worst} of
$K = \n{scenes}$, named \n{basis}; equation
\eqref{eq:one}, figure~\ref{fig:ladder}, table~\ref{tab:payoff}, theorem~\ref{thm:s},
section~\ref{sec:more} \cite{Page63}, table \source{payoff}. C1 holds.
\known{Shown, \n{podScenes}.} \known{Left out, \n{unknown}.}
\paragraph{Opening.} Words.
\begin{equation}\label{eq:one} a = \norm{b} \end{equation}
A survey is \cite{Page63}; another (\method{pod} \cite{Page63}).
\figureof{ladder}
\longtableof{\small}{tab:payoff}{Caption.}{tab_scenes.tex}
\end{document}
"""
SUPPLEMENT = r"""
\renewcommand{\thesection}{S\arabic{section}}
\renewcommand{\thefigure}{S\arabic{figure}}
\renewcommand{\thetheorem}{S\arabic{theorem}}
\begin{document}
\section{More}\label{sec:more} See \ref{sec:first}.
\figureof{spring_runs}
\figureof{bar_runs}
\begin{theorem}\label{thm:s} Let $x$ be \n{all}. \end{theorem}
\end{document}
"""
NUMBERS = """
podError: {table: payoff, rows: {method: pod}, column: error_train, percent: true}
worst: {table: payoff, column: error_train, take: max, digits: 3}
scenes: {table: payoff, column: scenes, take: max}
basis: {table: payoff, rows: {method: pod}, column: position_basis}
podScenes: {table: payoff, rows: {method: pod}, column: scenes}
unknown: {table: payoff, rows: {method: x}, column: scenes}
all: {table: study, column: scenes}
"""
CLAIM = """
sets: {own: [numpy]}
C1:
  text: A <b> claim.
  source: Somebody
  paper: errors are large
  section: "1"
  shown: "2"
  qualifiers: none
  figure_or_table: ladder
  published:
    - {what: all rows, metric: local_share, where: {implementation: ["@own"]}, compare: ">=",
       threshold: 0.7}
  beyond: [{what: others, metric: local_share, compare: "<=", threshold: 0.7}]
  changes: [{date: 2026-11-21, after_data: true, reason: "First version of it."}]
"""
TABLES = {
    "payoff": frame(
        "method position_basis scenes error_train", ("pod", "full", 3, 1.5e-4),
        ("deim", 'a, "b"', 4, 0.2512),
    ),
    "claims_tests": frame(
        "part claim what satisfied of least median most verdict",
        *((p, "C1", "all rows", 3, 4, 0.5, 0.75, 1.0, "holds") for p in ("published", "beyond")),
    ).assign(margin=1.5),
    "local_share": frame("implementation local_share", ("numpy", 0.75)),
    "ladder": frame("gain", (2.0,)),
    "claims": frame(
        "claim verdict verdict_beyond verdict_both verdict_beyond_both measured",
        ("C1", "holds", "depends", "holds", "does not hold", "0.25 x"),
    ),
}  # fmt: skip


def ranks(payoff: pd.DataFrame) -> Iterator[Any]:
    """A TeX table of the manuscript, with a number among words."""
    yield r"l>{\raggedright\arraybackslash}p{2cm}r", ["reduction", "error", "in"]
    yield [r"\texttt{pod}", format_number(payoff.error_train[0]), "3"]
    yield [r"\texttt{deim}", format_number(payoff.error_train[1]), "holds (4)"]


INPUTS = (
    "numbers.json", "tab_scenes.tex", "macros.tex", "figures.tex", "main.bbl", "supplement.bbl",
)  # fmt: skip


def write_study(folder: Path) -> dict[str, object]:
    """A manuscript of two documents with its inputs; arguments of `article`."""
    for name, table in TABLES.items():
        write_table(table, folder / "tables" / f"{name}.csv")
    captions_of = dict.fromkeys(("spring_runs", "bar_runs"), "Runs.") | {
        "ladder": r"$r \le 6$ modes."
    }
    facts = build.Facts(
        captions=captions_of, part=None, full_study="config/default.yaml",
        tables={name: [{"scenes": 2}] for name in FACTS if name != "machine"},
    )  # fmt: skip
    texts = {"main": SPECIAL + MAIN, "supplement": SPECIAL + SUPPLEMENT}
    preamble = (ROOT / "paper" / "preamble.tex").read_text(encoding="utf-8")
    for name, text in {**texts, "preamble": preamble}.items():
        write_text(text, folder / "paper" / f"{name}.tex")
    write_text(NUMBERS, folder / "paper" / "numbers.yaml")
    units = dict.fromkeys(Units.model_fields, 1.0)
    record = Record(**machine().model_dump(), units=units)
    write_text(record.model_dump_json(), folder / "machine.json")
    given = {
        "source": [folder / "paper" / "main.tex"],
        "references": ROOT / "paper" / "references.bib",
        "tables": named(folder / "tables", [f"{name}.csv" for name in TABLES]),
        "machine": File(str(folder / "machine.json"), {}),
        "facts": facts,
        "made": ["claims_table"],
    }
    inputs = {Path(name).stem: folder / "inputs" / name for name in INPUTS}
    build.write_inputs(**given, outputs=inputs)
    write_text(CLAIM, folder / "claims.yaml")
    for name in facts.captions:
        write_text("%PDF-1.4", folder / "figures" / f"{name}.pdf")
        with atomic_path(folder / "figures" / f"{name}.png") as path:
            Image.new("RGB", (40, 20), "white").save(path, "PNG")
    return given | {
        "inputs": [File(str(path), {"name": path.name}) for path in inputs.values()],
        "figures": named(folder / "figures", [f"{name}.pdf" for name in facts.captions]),
        "pictures": named(folder / "figures", [f"{name}.png" for name in facts.captions]),
        "claims": folder / "claims.yaml",
        "added": {"own": ["compiled"]},
        **{name: ROOT / FOLDER / file for name, file in ASSETS.items()},
    }


def test_a_cell_of_a_wrong_type_is_named_before_the_manuscript_is_made(tmp_path, monkeypatch):
    infinite = TABLES["claims_tests"].assign(satisfied=float("inf"))
    monkeypatch.setitem(TABLES, "claims_tests", infinite)
    with pytest.raises(StorageError, match=r"'satisfied'.*row 1: 'inf'"):
        write_study(tmp_path)


def test_the_manuscript_omits_unreliable_times_and_says_so(tmp_path, monkeypatch):
    columns = "control_low control_high processor_share"
    for share in (1.0, 0.5):
        folder = tmp_path / f"{share}"
        monkeypatch.setitem(TABLES, "frame_times", frame(columns, (1.0, 1.0, share)))
        pages = write_pages(write_study(folder), folder / "out")
        texts = [pages / "index.html", folder / "inputs" / "macros.tex"]
        index, macros = (text.read_text("utf-8") for text in texts)
        packed = [(pages / "tables" / f"{name}.html").read_text() for name in ("payoff", "claims")]
        data = [re.search(r'id="data">([^<]+)', page)[1] for page in packed]
        data = [gzip.decompress(base64.b64decode(text)).decode() for text in data]
        reliable = share == 1.0
        assert ("times of this run are unreliable" in index) is not reliable
        assert ("times of this run are unreliable" in macros) is not reliable
        # the error of the fastest run depends on times
        assert all(("0.25" in text) is reliable for text in (index, macros, *data))


def named(folder: Path, names: Iterable[str]) -> list[File]:
    """Files of a folder, with their names as labels."""
    return [File(str(folder / name), {"name": Path(name).stem}) for name in names]


def write_pages(given: dict[str, object], out: Path) -> Path:
    outputs = {name: str(out / place.pattern) for name, place in article.writes.items()}
    article.function(**given, outputs=outputs)
    return out / "article"


@pytest.fixture(scope="module", autouse=True)
def one_table() -> Iterator[None]:
    """Replace the tables of the study by the one table of the manuscripts of these tests."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (build, textables):
            patch.setattr(module, "TEX_TABLES", {"tab_scenes": ranks})
        yield


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The article of the small study; the page of models is replaced."""
    folder = tmp_path_factory.mktemp("article")
    pages = write_pages(write_study(folder), folder)
    (pages / "live.html").write_text("<!DOCTYPE html><title>Models</title>", encoding="utf-8")
    return pages


TAG = re.compile(r"<[a-z]\w*[^>]*>")
KEY = re.compile(r"""([\w-]+)=(?:"([^"]*)"|'([^']*)'|([^\s>"']+))""")


class Links:
    """Identifiers of a page, and its links: class, address, words."""

    def __init__(self, path: Path) -> None:
        page = path.read_text(encoding="utf-8")
        made = [(re.match(r"<\w+", tag)[0][1:], self.keys(tag)) for tag in TAG.findall(page)]
        self.names = [keys["id"] for _, keys in made if "id" in keys]
        self.links = [
            (tag, keys.get("src") or keys.get("href") or "", "")
            for tag, keys in made
            if tag in ("img", "script", "link")
        ]
        for tag, words in re.findall(r"(<a [^>]*href=[^>]*>)(.*?)</a>", page, re.DOTALL):
            keys = self.keys(tag)
            # the TeX of a formula
            text = re.sub(r"<[^>]*>", "", re.sub(r"(?s)^.*<annotation[^>]*>", "", words))
            self.links.append((keys.get("class", ""), keys["href"], unescape(text)))

    @staticmethod
    def keys(tag: str) -> dict[str, str]:
        return {name: unescape(a or b or c) for name, a, b, c in KEY.findall(tag)}


@cache
def table_at(path: Path) -> pd.DataFrame:
    """Table in a page, with its number of rows."""
    page = path.read_text(encoding="utf-8")
    packed = re.search(r'id="data">([^<]*)<', page)
    assert packed
    table = pd.read_csv(io.BytesIO(gzip.decompress(base64.b64decode(packed[1]))))
    return table.assign(row=range(1, len(table) + 1))


@cache
def rows_at(path: Path, key: str) -> int:
    """Number of rows of a page's table that agree with a key."""
    parts = [re.fullmatch(r"(.*?)(!?=)(.*)", part) for part in key.split("|")]
    return len(matching(table_at(path), [part.groups() for part in parts if part]))


def test_each_number_equals_that_of_the_pdf_and_links_to_its_cells(small):
    origins = json.loads((small.parent / "inputs" / "numbers.json").read_text(encoding="utf-8"))
    numbers, seen = {number["key"]: number for number in origins["numbers"].values()}, set()
    asked = {entry.key: entry for entry in entries(small.parent / "paper").values()}
    for page in PAGES.values():
        for kind, address, words in Links(small / page).links:
            key = unquote(address).removeprefix("tables/").replace(".html#", "|", 1)
            if kind != "val" or key not in numbers:
                continue
            number = numbers[key]
            seen.add(key)
            text = re.sub(r"^\\ensuremath\{(.*)\}$", r"\1", number["text"])
            assert words == text.replace(r"\_", "_")
            table = table_at(small / "tables" / f"{number['table']}.html")
            cells = table[number["column"]].iloc[number["rows"]]
            value = AGGREGATES[number["take"]](cells) if number["take"] else cells.iloc[0]
            value = 100.0 * value if asked[key].percent else value
            assert format_number(value, asked[key].digits) == number["text"]
    assert seen == {key for key, number in numbers.items() if number["rows"]}


def test_a_table_of_the_manuscript_links_to_its_rows(small):
    rows = [link for link in Links(small / "index.html").links if "row=" in link[1]]
    assert [(a, w) for _, a, w in rows] == [
        ("tables/payoff.html#row=1", r"1.5\cdot 10^{-4}"),
        ("tables/payoff.html#row=1", "3"),
        ("tables/payoff.html#row=2", "0.25"),
        ("tables/payoff.html#row=2", "4"),
    ]


RUNS = frame("scene group error", ("a_b", "x_y", 0.0123), ("a_b", "z", 0.25), ("c", "z", 0.5))


@pytest.mark.parametrize(
    ("cells", "key", "number"),
    [
        (r"\texttt{a\_b} & x y & 3", "scene=a_b|group=x_y", "3"),
        (r"\texttt{a\_b} $\times 4$ & z & 3", "scene=a_b|group=z", "3"),
        (r"\texttt{a\_b} &  & 0.012", "scene=a_b", "0.012"),  # rounded
        (r"\texttt{c} & full order & 0.50", "scene=c|error=0.50", "0.50"),
        (r"\texttt{d} & z & 2 of 3", "group=z", "2 of 3"),
        ("d & z & holds (2/3, 1/4)", "group=z", "2/3, 1/4"),
        ("d & z & holds (2/3); both errors: mixed", "group=z", "2/3"),
        (r"d & z & \textcolor{okred}{blow-up, 34}", "group=z", "34"),
        (r"d & z & $\ge$ 0.70", "group=z", r"$\ge$ 0.70"),
        ("d & z & 3.4 (3.1 to 3.6) (loses)", "group=z", "3.4 (3.1 to 3.6) (loses)"),
    ],
)
def test_numbers_link_to_rows_that_agree_in_the_common_columns(cells, key, number):
    table = [("llr", ["scene", "group", "error"]), cells.split(" & ")]
    made = linked_table(table, {"other": pd.DataFrame({"scene": ["c"]}), "runs": RUNS})
    assert f"{f'runs|{key}'.encode().hex()}}}{{{number}}}" in made
    assert made.count("href") == 1


def study_or_small(small: Path) -> list[Path]:
    """The small article and, if a run has made it, that of the full study."""
    made = ROOT / "results" / "article"
    return [small, *([made] if (made / "index.html").is_file() else [])]


def test_every_link_has_a_target(small):
    for pages in study_or_small(small):
        found = {path: Links(path) for path in pages.resolve().rglob("*.html")}
        links = [(path, *link) for path, page in found.items() for link in page.links]
        inside = [link for link in links if not re.match("https?:|data:", link[2])]
        assert len(inside) > 40
        for path, _, address, words in inside:
            file, _, name = unquote(address).partition("#")
            target = (path.parent / file).resolve() if file else path
            assert target.is_file(), f"{path.name}: {address}"
            if name and target.parent.name == "tables":
                none = words == MISSING or name.endswith(("|count", "|distinct"))
                assert none or rows_at(target, name), f"{path.name}: {address}"
            elif name and target.suffix == ".html":
                assert name in found[target].names, f"{path.name}: {address}"
        for path, page in found.items():
            assert len(set(page.names)) == len(page.names), path.name


def numbers_of_tex(sources: Mapping[str, str], inputs: Path, folder: Path) -> dict[str, str]:
    """Number of every label, by its address in the article, as TeX counts; pictures are boxes."""
    program = find_pdflatex(packages_of("".join(sources.values())))
    found = {}
    for name, text in sources.items():
        (folder / f"{name}.tex").write_text(rf"\PassOptionsToPackage{{demo}}{{graphicx}}{text}")
        command = [program, "-interaction=nonstopmode", "-halt-on-error", f"{name}.tex"]
        places = {**os.environ, "TEXINPUTS": f"{inputs.resolve()}:"}
        done = subprocess.run(command, cwd=folder, env=places, capture_output=True, check=False)
        assert done.returncode == 0, done.stdout[-500:]
        written = (folder / f"{name}.aux").read_text("utf-8")
        labels = re.findall(r"\\newlabel\{([^{}]+)\}\{\{([^{}]*)\}", written)
        found |= {f"{PAGES[name]}#{label}": number for label, number in labels}
    return found


def test_references_have_the_numbers_of_the_pdf(small, tmp_path):
    """Reference: TeX's .aux files, also of the full study if a run has made its article."""
    for pages in study_or_small(small):
        paper, inputs = (
            (pages.parent / "paper", pages.parent / "inputs")
            if pages == small
            else (ROOT / "paper", pages.parent / "paper")
        )
        (folder := tmp_path / str(pages == small)).mkdir()
        numbers = numbers_of_tex(documents(paper), inputs, folder)
        links = [link for page in PAGES.values() for link in Links(pages / page).links]
        placed = {address: n for address, n in numbers.items() if "#fig:" in address}
        root = paper.parent if pages == small else ROOT
        figures = {f"fig:{name}": number for name, number in figure_numbers(root).items()}
        assert placed == {address: figures[address.partition("#")[2]] for address in placed} != {}
        shown = {a: words.strip("()") for kind, a, words in links if a in numbers and not kind}
        assert shown == {address: numbers[address] for address in shown}
        kinds = {re.split("[#:]", address)[1] for address in shown}
        assert {"eq", "fig", "tab", "thm", "sec"} <= kinds
    assert ("claim", "claims.html#C1", "C1") in Links(small / "index.html").links


def test_a_reference_to_a_missing_label_is_named(tmp_path):
    given, path = write_study(tmp_path), tmp_path / "paper" / "main.tex"
    write_text(path.read_text("utf-8").replace(r"\ref{thm:s}", r"\ref{thm:lost}"), path)
    with pytest.raises(PaperError, match="label thm:lost, which does not exist"):
        write_pages(given, tmp_path)
    assert not (tmp_path / "article" / "index.html").exists()


def test_blocks_about_results_that_the_study_lacks_are_left_out(small):
    text, claims = ((small / f"{page}.html").read_text("utf-8") for page in ("index", "claims"))
    shown = {words: words in text for words in ("Shown, ", "Full.", "Left out", "lacking")}
    assert shown == {"Shown, ": True, "Full.": True, "Left out": False, "lacking": False}
    assert "(implementation: numpy, compiled)" in claims
    assert "Improved method: mixed." in claims
    text = re.sub(r"<annotation.*?</annotation>|<[^>]*>", "", text)
    assert "$" not in text
    assert "A survey is Page (1963); another (pod) (Page 1963)." in text


def test_the_article_is_made_with_the_same_bytes_again(small, tmp_path):
    again = write_pages(write_study(tmp_path), tmp_path)
    for path in (p for p in again.rglob("*") if p.is_file() and p.name[0] != "."):
        assert path.read_bytes() == (small / path.relative_to(again)).read_bytes(), path.name


@pytest.mark.slow
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (390, "light"), (1400, "dark")])
def test_pages_open_without_a_message_and_axe_finds_no_error(small, width, scheme):
    for pages in study_or_small(small):
        for name in ("index", "supplement", "claims", "tables", "tables/payoff"):
            with page_at((pages / f"{name}.html").as_uri(), width, 900) as page:
                page.emulate_media(color_scheme=scheme)
                found = Axe().run(page, options={"preload": False}).response["violations"]
                assert [(each["id"], each["nodes"][0]["html"]) for each in found] == [], name
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                assert page.said == []
                assert {url.split(":")[0] for url in page.asked} <= {"file", "data", "blob"}


@pytest.mark.slow
def test_the_page_of_a_table_shows_the_rows_of_a_link_and_the_last_verification(small, tmp_path):
    for pages in study_or_small(small):
        inputs = pages.parent / ("inputs" if pages == small else "paper")
        read = json.loads((inputs / "numbers.json").read_text(encoding="utf-8"))["numbers"]
        numbers = {number["key"]: number for number in read.values()}
        for table in {number["table"] for number in numbers.values()}:
            keys = [key for key, number in numbers.items() if number["table"] == table]
            with page_at((pages / "tables" / f"{table}.html").as_uri(), 900, 700) as page:
                page.wait_for_selector("#rows td")
                filters = [key.partition("|")[2] for key in keys]
                rows = page.evaluate("keys => keys.map(pdromTable.matching)", filters)
                for key, found in zip(keys, rows, strict=True):
                    assert set(numbers[key]["rows"]) <= set(found), key
                    assert numbers[key]["take"] or len(found) <= 1, key
    write_verified({"table payoff": "differs, row 2"}, small)
    address = (small / "tables" / "payoff.html").as_uri() + "#method=deim|error_train"
    with page_at(address, 900, 700) as page:
        page.wait_for_selector("#rows td.asked")
        assert page.inner_text("[data-verified]") == "differs, row 2"
        assert page.inner_text("#rows td.asked") == "0.2512"
        page.get_by_role("button", name="All rows").click()
        page.get_by_role("button", name="scenes").click(click_count=2)
        assert page.locator("#rows tbody tr").first.inner_text().startswith("2\tdeim")
        page.evaluate("location.hash = '#error_train%'")
        page.wait_for_function("document.getElementById('every').hidden === false")
        assert page.locator("#rows tbody tr").count() == 2
        page.evaluate("location.hash = encodeURIComponent('a\"]')")
        page.locator("#column", has_text='no column a"].').wait_for()
        assert page.said == []
    cut, whole = tmp_path / "tables" / "cut.html", (small / "tables" / "payoff.html").read_bytes()
    cut.parent.mkdir()
    shutil.copy(small / "article.js", tmp_path)
    cut.write_bytes(whole[: whole.index(b'id="data">') + 40])
    with page_at(cut.as_uri(), 900, 700) as page:
        page.locator("#asked", has_text="this file was truncated").wait_for()
    write_verified({}, small)
