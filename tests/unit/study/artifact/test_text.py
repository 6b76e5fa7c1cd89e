"""Texts of users: accepted characters are typeset, all others are refused by name."""

import unicodedata
import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure

from pdrom.core.errors import ConfigurationError, PaperError
from pdrom.view import style
from places import ROOT
from study.artifact.text import escape, replaced, require_typeset
from study.paper.source import whole_source
from study.paper.tex import build_pdfs

TITLES = [
    "costs $ 5",
    "$ and $",
    "γ-bounded μ ≤ 2",
    "Kotěšovec & Søn_1 {50 %} #2",
    r"a\b^~",
    "Łódź",
]


# Every character that can be typeset.
EVERY = [
    c for c in map(chr, range(0x20, 0x2300)) if unicodedata.normalize("NFC", c) == replaced(c) == c
]


def test_every_special_character_is_escaped():
    assert escape("a_b%&#$") == r"a\_b\%\&\#\$"
    assert escape("\\{}~^") == r"\textbackslash{}\{\}\textasciitilde{}\textasciicircum{}"
    assert escape("plain é 1") == "plain é 1"
    assert escape("γΩ") == r"\ensuremath{\gamma}\ensuremath{\Omega}"


def test_every_accepted_character_is_typeset(tmp_path):
    """One document with every character compiles with the packages of the preamble."""
    assert len(EVERY) > 350
    preamble = whole_source(ROOT / "paper" / "main.tex").split(r"\input{macros")[0]
    lines = [rf"\noindent x{escape(c)}y \texttt{{x{escape(c)}y}}" + "\n" for c in EVERY]
    lines += [escape(title) + "\n\n" for title in TITLES]
    document = [preamble, r"\begin{document}", *lines, r"\end{document}"]
    source = tmp_path / "all.tex"
    source.write_text("\n".join(document), encoding="utf-8")
    build_pdfs({source: tmp_path / "all.pdf"}, [])
    assert (tmp_path / "all.pdf").read_bytes().startswith(b"%PDF")


def test_figures_draw_every_accepted_character():
    with style.look(), warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = Figure()
        for i, text in enumerate(["".join(EVERY), *TITLES]):
            figure.text(0.0, 0.1 * i, style.plain_words(text))
        FigureCanvasAgg(figure).draw()


@given(st.text(alphabet=st.sampled_from(EVERY), min_size=1))
def test_no_text_is_mathematics_in_a_figure(text):
    assert not is_math_text(style.plain_words(text))


@pytest.mark.parametrize(("text", "named"), [("投影", "U+6295"), ("a\x07", "U+0007")])
def test_a_character_that_cannot_be_typeset_is_refused_by_name(text, named):
    with pytest.raises(ConfigurationError, match="cannot be typeset") as error:
        require_typeset(text, "methods.yaml: pod.title")
    assert named in str(error.value)
    assert str(error.value).startswith("methods.yaml: pod.title = ")
    assert "\x07" not in str(error.value)
    with pytest.raises(PaperError, match="cannot be typeset"):
        escape(text)


def test_names_of_a_machine_lose_characters_that_cannot_be_typeset():
    assert replaced("Core™ é 3") == "Core? é 3"
