"""The manuscript: every number of its text comes from a table; its references and figures."""

import re

import pandas as pd
import pytest
from matplotlib.figure import Figure

from pdrom.core.errors import PaperError
from pdrom.core.yamlfile import read_yaml
from places import ROOT
from study.figures.kit.declaration import declarations
from study.paper.build import bibliography, paper
from study.paper.macros import sentences
from study.paper.numbers import entries, names_of, number_of
from study.paper.source import documents, figure_numbers
from study.paper.tex import build_pdfs, packages_of
from study.paper.textables import TEX_TABLES
from study.pipeline.plan import Plan
from study.pipeline.study import Study
from study.tables import declared

SOURCES = documents(ROOT / "paper")
PAPER = SOURCES["main"]
SOURCE = "".join(SOURCES.values())
OWN = documents(ROOT / "paper" / "own")
NUMBERS = entries(ROOT / "paper")

# Text whose digits state no result: mathematics, keys, lengths, names of claims.
_NOT_PROSE = [
    r"(?<!\\)%.*",
    r"\\begin\{(equation|align)\*?\}.*?\\end\{\1\*?\}",
    r"(?s:\\begin\{(theorem|proposition)\}.*?\\end\{\1\})",
    r"(?s:\\emph\{Proof\.\}.*?\\proven)",
    r"\\(n|cite|label|ref|eqref|input|includegraphics|scene|method|source|figureof|fontsize)"
    r"(\[[^\]]*\])?\{[^{}]*\}",
    r"\\multicolumn\{\d\}|\\cline\{\d-\d\}",
    r"\\(setlength|vspace|hspace)\{[^{}]*\}(\{[^{}]*\})?",
    r"\{fig:[a-z_]+\}|\\begin\{[a-z]+\}(\[[^\]]*\])?(\{[^{}]*\})?",
    r"\bC\d+\b",
]


# Digits of a formula that are no result: indices, exponents, factors of a symbol, a bound 0.
_NOTATION = r"[_^](\{[^{}]*\}|.)|\d+(?=[a-zA-Z])|\\(ge|le)\s*0(?![.\d])"


def prose(source: str) -> str:
    """Body text without mathematics, propositions, proofs, keys, lengths and names of claims."""
    text = source.rpartition(r"\begin{document}")[2]
    for pattern in _NOT_PROSE:
        text = re.sub(pattern, " ", text, flags=re.S if "begin" in pattern else 0)
    formula = r"(?<!\\)\$.*?(?<!\\)\$"
    return re.sub(formula, lambda found: re.sub(_NOTATION, " ", found[0]), text, flags=re.S)


def typed_numbers(source: str) -> list[str]:
    return [m.group(0) for m in re.finditer(r".{0,30}\d[\d.,]*.{0,20}", prose(source))]


@pytest.mark.parametrize("document", OWN)
def test_no_float_is_pending_where_a_long_table_of_another_study_begins(document):
    """A long table continues on the next page, where a float would also be placed."""
    pattern = r"(\\(picture|figure)of|\\begin\{(table|figure)\})(?s:.)*\\longtableof"
    text = OWN[document].rpartition(r"\begin{document}")[2]
    assert not any(re.search(pattern, part) for part in text.split(r"\clearpage"))


@pytest.mark.parametrize("document", SOURCES)
def test_no_result_is_typed_in_the_manuscript(document):
    assert typed_numbers(SOURCES[document]) == typed_numbers(OWN[document]) == []


def test_the_text_of_a_study_of_other_scenes_mentions_its_figures_and_no_claim():
    source = "".join(text.partition(r"\title")[2] for text in OWN.values())
    assert re.findall(r"verdict|claim|preprint|replication|ifpart", source) == []
    figures = set(re.findall(r"(?:figureof|pictureof)\{(\w+)", source))
    tables = set(re.findall(r"(?:label\{|\}\{)tab:(\w+)\}", source))
    assert set(re.findall(r"\\ref\{fig:(\w+)\}", source)) <= figures <= set(declarations())
    assert set(re.findall(r"\\ref\{tab:(\w+)\}", source)) == tables != set()
    for text in OWN.values():
        assert r"\bibitem" in bibliography(text, ROOT / "paper" / "references.bib")
        for name in names_of(text):
            assert NUMBERS[name].table in ("study", "scenes", "methods", "machine")


def test_a_study_of_other_scenes_has_another_text():
    settings = read_yaml(ROOT / "config" / "default.yaml")
    changes = {"scenes": ["ball_shell"], "noise": {"cases": {}}}
    study = Study({**settings, **changes}, ROOT, configuration="config/mine.yaml")
    made = Plan(study).job(paper)
    facts = made.settings["facts"]
    assert (facts["part"], facts["full_study"], facts["pages"]) == (None, "config/mine.yaml", {})
    assert made.inputs["source"][:2] == ["paper/own/main.tex", "paper/own/supplement.tex"]
    of_default = Plan(Study(settings, ROOT)).job(paper)
    assert of_default.inputs["source"][:2] == ["paper/main.tex", "paper/supplement.tex"]


@pytest.mark.parametrize(
    "sentence",
    ["The error is 0.03.", "It blew up at frame 12.", "A speed-up of 50 times.", r"5\,\% remain",
     "The error is $0.03$.", r"It stays below $10^{-3}$.", r"$50\times$ faster",
     r"an $e \le 0.2$"],
)  # fmt: skip
def test_a_typed_result_is_found(sentence):
    changed = PAPER.replace(r"\paragraph{Limitations.}", rf"\paragraph{{Limitations.}} {sentence}")
    assert len(typed_numbers(changed)) == 1


def test_the_preamble_loads_only_packages_of_both_tex_systems():
    allowed = {
        "fontenc", "inputenc", "lmodern", "amsmath", "geometry", "graphicx", "xcolor", "array",
        "longtable", "enumitem", "microtype", "hyperref", "xr-hyper", "tabularx", "rotating", "url",
    }  # fmt: skip
    assert set(packages_of(SOURCE)) <= allowed


def test_every_number_is_a_column_of_a_table_and_is_cited():
    study = Study(read_yaml(ROOT / "config" / "default.yaml"), ROOT)
    facts = Plan(study).job(paper).settings["facts"]["tables"]
    tables = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    tables |= {name: pd.DataFrame(rows)[:0] for name, rows in facts.items()}
    for name, entry in NUMBERS.items():
        if entry.table != "machine":
            number_of(name, NUMBERS, tables)  # which refuses other columns
    assert set(names_of(SOURCE + "".join(OWN.values()))) == set(NUMBERS)


def test_every_figure_is_shown_or_named_and_the_text_mentions_each_shown_figure():
    shown = re.findall(r"\\figureof\{([a-z_]+)\}", SOURCE)
    assert len(set(shown)) == len(shown)
    named = {name.replace("\\_", "_") for name in re.findall(r"\\texttt\{([a-z_\\]+)\}", SOURCE)}
    assert set(shown) <= set(declarations()) <= {*shown, *named}
    assert set(shown) <= set(re.findall(r"\\ref\{fig:([a-z_]+)\}", SOURCE))


def test_every_table_is_included_and_mentioned_in_the_text():
    assert sorted(re.findall(r"tab_\w+", SOURCE)) == sorted(TEX_TABLES)
    labels = re.findall(r"\\label\{(tab:[a-z]+)\}|\\longtableof\{.*?\}\{(tab:[a-z]+)\}", SOURCE)
    shown = {one or other for one, other in labels}
    assert shown == set(re.findall(r"\\ref\{(tab:[a-z]+)\}", SOURCE)) != set()


def test_numbers_that_a_configuration_may_lack_stand_in_optional_blocks():
    """Text outside the blocks has only numbers that every configuration has."""
    blocks = [sentence.text for sentence in sentences(SOURCE)]
    outside = SOURCE
    for block in blocks:
        outside = outside.replace(rf"\known{{{block}}}", "")
    for entry in map(NUMBERS.__getitem__, names_of(outside)):
        always = entry.table in ("study", "claims", "machine")
        assert always or (entry.table == "scenes" and entry.take == "max")
    assert all(names_of(block) for block in blocks)


def test_the_same_inputs_give_the_same_bytes_in_every_folder(tmp_path):
    """An included PDF contains the name of its file unless the preamble suppresses it."""
    settings = [line for line in SOURCE.splitlines() if line.startswith(r"\pdf")]
    start = r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage{lmodern,graphicx}"
    picture = r"\noindent\includegraphics[width=\textwidth]{picture.pdf}"
    body = rf"\begin{{document}}{picture}\end{{document}}"
    document = "\n".join([start, *settings, body])
    made = []
    for name in ("one", "another"):
        folder = tmp_path / name / "paper"
        folder.mkdir(parents=True)
        figure = Figure()
        figure.subplots().plot([0, 1])
        figure.savefig(folder / "picture.pdf", metadata={"CreationDate": None})
        (folder / "main.tex").write_text(document, encoding="utf-8")
        build_pdfs({folder / "main.tex": tmp_path / name / "main.pdf"}, [])
        made.append((tmp_path / name / "main.pdf").read_bytes())
    assert made[0] == made[1]


def test_citations_have_entries_and_the_pdf_the_title_and_the_authors_of_the_manuscript():
    for source in SOURCES.values():
        entries = bibliography(source, ROOT / "paper" / "references.bib")
        assert entries.count(r"\bibitem") > 10
        title = re.search(r"\\title\{([^\\}]*)", source)[1]
        author = re.search(r"\\author\{([^}]*)\}", source)[1]
        assert re.search(rf"\\hypersetup\{{\s*pdftitle=\{{{re.escape(title)}", source)
        assert rf"pdfauthor={{{author}}}" in source


BIB = """
@article{beta, author = {Bea B{\\'e}ta}, title = {The {DEIM} of beta}, journal = {J. Beta},
  year = 2011, volume = 3, pages = {1--2}}
@book{alpha, author = {Al Alpha and Cy Gamma}, title = {Alpha \\& more}, publisher = {Pub},
  year = 2001}
@misc{unused, author = {No One}, title = {Unused}, year = 1999}
"""


def test_only_cited_entries_are_printed_in_order(tmp_path):
    references = tmp_path / "references.bib"
    references.write_text(BIB)
    text = bibliography(r"\cite{beta} \cite{alpha,beta}", references)
    assert text.startswith(r"\begin{thebibliography}")
    assert text.rstrip().endswith(r"\end{thebibliography}")
    assert text.index(r"\bibitem{beta}") < text.index(r"\bibitem{alpha}")
    assert text.count(r"\bibitem") == 2
    assert "Unused" not in text
    for piece in ("Bea B{é}ta", "{DEIM}", "2011", "Cy~Gamma", r"Alpha \& more", "2001"):
        assert piece in text
    assert r"\bibitem" not in bibliography("text", references)
    assert text == bibliography(r"\cite{beta, alpha} \citet{unused} \cite {unused}", references)


@pytest.mark.parametrize(
    ("content", "source", "message"),
    [
        (BIB, r"\cite{alpha,gone} \cite{lost}", "no entry for gone, lost"),
        ("@article{alpha, title = {unfinished", r"\cite{alpha}", ""),
        ("@inbook{alpha, author = {A}, title = {T}, chapter = 3, year = 2001}", r"\cite{alpha}",
         "missing publisher in alpha"),
    ],
)  # fmt: skip
def test_faults_of_the_manuscript_are_named_with_the_file(tmp_path, content, source, message):
    path = tmp_path / "references.bib"
    path.write_text(content)
    with pytest.raises(PaperError, match=rf"references\.bib.*{message}"):
        bibliography(source, path)


def test_figures_are_numbered_as_the_source_places_them(tmp_path):
    (tmp_path / "paper" / "sections").mkdir(parents=True)
    text = "\\figureof{ladder}\n% \\figureof{noise}\n\\input{sections/a.tex}\\figureof{scaling}"
    (tmp_path / "paper" / "main.tex").write_text(text)
    (tmp_path / "paper" / "supplement.tex").write_text(r"\figureof{singular_values}")
    section = tmp_path / "paper" / "sections" / "a.tex"
    section.write_text(r"at 5\% \figureof{bar_runs}\figureof{strain_runs}")
    own = {"ladder": "1", "bar_runs": "2", "strain_runs": "3", "scaling": "4"}
    assert figure_numbers(tmp_path) == own | {"singular_values": "S1"}
    section.unlink()
    with pytest.raises(PaperError, match=r"no file .*a\.tex"):
        figure_numbers(tmp_path)


def test_every_figure_is_made_by_figureof_outside_optional_blocks():
    for text in SOURCES.values():
        assert len(re.findall(r"\\begin\{figure", text)) == 1, "the definition of \\figureof"
        assert [s.text for s in sentences(text) if "figureof" in s.text] == []
