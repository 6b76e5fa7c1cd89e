"""Numbers of the figures in the order of the source; LaTeX's are asked in test_article.py."""

import re

import pytest

from pdrom.core.errors import PaperError
from places import ROOT
from study.paper.figure_numbers import Numbers, figure_numbers
from study.paper.macros import sentences
from study.paper.source import documents

PAPER = ROOT / "paper"


def test_figures_are_numbered_as_the_source_places_them(tmp_path):
    (tmp_path / "paper" / "sections").mkdir(parents=True)
    text = "\\figureof{ladder}\n% \\figureof{noise}\n\\input{sections/a.tex}\\figureof{scaling}"
    (tmp_path / "paper" / "main.tex").write_text(text)
    (tmp_path / "paper" / "supplement.tex").write_text(r"\figureof{singular_values}")
    section = tmp_path / "paper" / "sections" / "a.tex"
    section.write_text(r"at 5\% \figureof{bar_runs}\figureof{strain_runs}")
    found = figure_numbers(tmp_path)
    numbers = {name: n.manuscript for name, n in found.items() if n.manuscript}
    own = {"ladder": "1", "bar_runs": "2", "strain_runs": "3", "scaling": "4"}
    assert numbers == own | {"singular_values": "S1"}
    assert found["strain_runs"].words == "figure 3 of main.pdf, figure 7 of the preprint"
    words = "figure S1 of supplement.pdf, figure 9 of the preprint"
    assert found["singular_values"].words == words
    assert found["bending_runs"].words == "figure 5 of the preprint"
    assert Numbers(None, None).label("a") == "a"
    assert Numbers("4", None).label("a") == "a (figure 4 of main.pdf)"
    section.unlink()
    with pytest.raises(PaperError, match=r"no file .*a\.tex"):
        figure_numbers(tmp_path)


def test_nothing_but_figureof_makes_a_figure_and_every_configuration_has_all():
    for text in documents(PAPER).values():
        assert len(re.findall(r"\\begin\{figure", text)) == 1, "the definition of \\figureof"
        assert [s.text for s in sentences(text) if "figureof" in s.text] == []
