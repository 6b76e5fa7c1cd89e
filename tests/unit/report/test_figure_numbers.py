"""Numbers of the figures: those that LaTeX gives them, in the order of the source."""

import re

import pytest

from pdrom.core.errors import PaperError
from pdrom.report.figure_numbers import Numbers, figure_numbers
from pdrom.report.paper.figuretex import captions
from pdrom.report.paper.known import sentences
from pdrom.report.paper.source import whole_source
from pdrom.report.paper.tex import build_pdf
from places import ROOT

MAIN = ROOT / "paper" / "main.tex"


def test_figures_are_numbered_as_the_source_places_them(tmp_path):
    (tmp_path / "paper" / "sections").mkdir(parents=True)
    text = "\\figureof{ladder}\n% \\figureof{bounds}\n\\input{sections/a.tex}\\figureof{scaling}"
    (tmp_path / "paper" / "main.tex").write_text(text)
    section = tmp_path / "paper" / "sections" / "a.tex"
    section.write_text(r"at 5\% \figureof{bar_runs}\figureof{strain_runs}")
    found = figure_numbers(tmp_path)
    numbers = {name: n.manuscript for name, n in found.items() if n.manuscript}
    assert numbers == {"ladder": 1, "bar_runs": 2, "strain_runs": 3, "scaling": 4}
    assert found["strain_runs"].words == "figure 3 of main.pdf, figure 7 of the preprint"
    assert found["singular_values"].words == "figure 9 of the preprint"
    assert Numbers(None, None).label("a") == "a"
    assert Numbers(4, None).label("a") == "a (figure 4 of main.pdf)"
    section.unlink()
    with pytest.raises(PaperError, match=r"no file .*a\.tex"):
        figure_numbers(tmp_path)


def test_nothing_but_figureof_makes_a_figure_and_every_configuration_has_all():
    text = whole_source(MAIN)
    assert len(re.findall(r"\\begin\{figure", text)) == 1, "the definition of \\figureof"
    assert [s.text for s in sentences(text) if "figureof" in s.text] == []


def test_latex_gives_the_same_numbers(tmp_path):
    r"""Every \figureof of the manuscript as it is defined there; LaTeX fails at a wrong number."""
    numbers = {k: n.manuscript for k, n in figure_numbers(ROOT).items() if n.manuscript}
    source = whole_source(MAIN)
    definition = re.search(r"\\newcommand\{\\figureof\}.*?\\end\{figure\}\}", source, re.DOTALL)
    placed = re.findall(r"\\figureof\{(\w+)\}", source)
    assert definition
    assert set(placed) == set(numbers)
    lines = [
        r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage{lmodern}",
        r"\newcommand{\includegraphics}[2][]{}",
        captions(dict.fromkeys(numbers, "text")),
        definition[0],
        r"\newcommand{\due}[1]{\ifnum\value{figure}=#1\else\errmessage{not #1}\fi}",
        r"\begin{document}",
        *(rf"\figureof{{{name}}}\due{{{numbers[name]}}}" for name in placed),
        r"\end{document}",
    ]
    (tmp_path / "main.tex").write_text("\n".join(lines))
    build_pdf(tmp_path / "main.tex", tmp_path / "main.pdf", [])
