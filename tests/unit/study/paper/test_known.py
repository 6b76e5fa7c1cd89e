r"""Sentences and rows whose numbers a configuration does not hold: left out, sentences noted."""

import pandas as pd
import pytest

from pdrom.core.errors import PaperError
from study.paper.macros import decisions, is_held, macros, provenance, sentences
from study.paper.tex import build_pdfs

TABLES = {
    "runs": pd.DataFrame(
        {"scene": ["bar"], "method": ["pod"], "outcome": ["wrong"], "error": [0.5], "end": [None]}
    )
}
BAR, CLOTH = r"\val{runs|scene=bar|error}", r"\val{runs|scene=cloth|error}"
SOURCE = rf"""\known{{The bar has {BAR} \emph{{so}}.}} Always. \known{{The cloth has {CLOTH}.}}
\known{{And {CLOTH} again.}}

Next. \known{{Both: {BAR}, {CLOTH}.}}

\begin{{tabular}}{{lr}}
\hline
\row{{bar & {BAR} \\}}
\row{{cloth & {CLOTH} \\}}
\hline
\end{{tabular}}
"""


def test_blocks_are_found_with_their_paragraphs():
    found = sentences(SOURCE)
    assert [sentence.paragraph for sentence in found] == [0, 0, 0, 1, 2, 2]
    assert [sentence.is_row for sentence in found] == [False] * 4 + [True] * 2
    assert found[0].text == rf"The bar has {BAR} \emph{{so}}."


@pytest.mark.parametrize(
    "source", [r"\known{open {x}", r"\known{a \known{b} c}", r"\known{\row{b} c}"]
)
def test_faulty_blocks_are_named(source):
    with pytest.raises(PaperError, match=r"another one|not closed"):
        sentences(source)


def test_a_sentence_needs_all_of_its_numbers():
    assert decisions(SOURCE, TABLES)[:4] == ["shown", "noted", "dropped", "noted"]


def test_a_row_goes_without_a_note():
    assert decisions(SOURCE, TABLES)[4:] == ["shown", "dropped"]
    assert decisions(rf"\row{{{CLOTH} \\}} \known{{{CLOTH}}}", TABLES) == ["dropped", "noted"]


@pytest.mark.parametrize(
    ("key", "held"),
    [
        ("runs|scene=bar|error", True),
        ("runs|scene=bar|end", True),  # an empty cell of a run is held: it says that none was found
        ("runs|scene=cloth|error", False),
        ("runs|scene=cloth|error|max", False),
        ("runs|scene=bar|outcome=accurate|error|count", True),  # none of the runs: a number
        ("runs|scene=cloth|outcome=accurate|error|count", False),
    ],
)
def test_what_a_configuration_holds(key, held):
    assert is_held(key, TABLES) is held


def pages(tmp_path, part):
    """Length of the document that TeX makes of the source."""
    known = provenance({"main": decisions(SOURCE, TABLES)}, part, "config/default.yaml")
    document = "\n".join(
        [r"\documentclass{article}", r"\usepackage[T1]{fontenc}\usepackage{lmodern,xcolor}",
         r"\definecolor{okgrey}{gray}{0.4}",
         macros(SOURCE, TABLES) + known, r"\begin{document}",
         r"\ifpart PART \configuration\ of \fullstudy\fi", SOURCE, r"\typeout{end}",
         r"\end{document}"]
    )  # fmt: skip
    (tmp_path / "main.tex").write_text(document, encoding="utf-8")
    build_pdfs({tmp_path / "main.tex": tmp_path / "main.pdf"}, [])
    return (tmp_path / "main.pdf").stat().st_size


def test_tex_accepts_what_is_left(tmp_path):
    whole, part = pages(tmp_path, None), pages(tmp_path, "config/my_study.yaml")
    assert 0 < whole < part


def test_the_note_names_the_configuration_that_holds_the_numbers():
    text = provenance({"main": ["noted"]}, "config/tiny.yaml", "config/default.yaml")
    assert r"\parttrue" in text
    assert r"\newcommand{\configuration}{\texttt{config/tiny.yaml}}" in text
    assert r"[The full study (\texttt{config/default.yaml}) holds" in text
    assert r"\partfalse" in provenance({}, None, "config/default.yaml")
