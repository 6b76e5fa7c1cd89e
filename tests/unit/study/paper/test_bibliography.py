"""Bibliography of what is cited, in the order of citation."""

import pytest

from pdrom.core.errors import PaperError
from study.paper.build import bibliography

BIB = """
@article{beta, author = {Bea B{\\'e}ta}, title = {The {DEIM} of beta}, journal = {J. Beta},
  year = 2011, volume = 3, pages = {1--2}}
@book{alpha, author = {Al Alpha and Cy Gamma}, title = {Alpha & more}, publisher = {Pub},
  year = 2001}
@misc{unused, author = {No One}, title = {Unused}, year = 1999}
"""


@pytest.fixture
def references(tmp_path):
    """A small BibTeX file."""
    path = tmp_path / "references.bib"
    path.write_text(BIB.replace("&", "\\&"))
    return path


def test_cited_entries_only_in_order(references):
    text = bibliography(r"\cite{beta} \cite{alpha,beta}", references)
    assert text.startswith(r"\begin{thebibliography}")
    assert text.rstrip().endswith(r"\end{thebibliography}")
    assert text.index(r"\bibitem{beta}") < text.index(r"\bibitem{alpha}")
    assert text.count(r"\bibitem") == 2
    assert "Unused" not in text
    for piece in ("Bea B{é}ta", "{DEIM}", "2011", "Cy~Gamma", r"Alpha \& more", "2001"):
        assert piece in text
    assert text == bibliography(r"\cite{beta, alpha} \citet{unused} \cite {unused}", references)


@pytest.mark.parametrize(
    ("content", "source", "message"),
    [
        (BIB.replace("&", "\\&"), r"\cite{alpha,gone} \cite{lost}", "no entry for gone, lost"),
        ("@article{alpha, title = {unfinished", r"\cite{alpha}", ""),
        ("@inbook{alpha, author = {A}, title = {T}, chapter = 3, year = 2001}", r"\cite{alpha}",
         "missing publisher in alpha"),
    ],
)  # fmt: skip
def test_faults_are_named_with_the_file(tmp_path, content, source, message):
    path = tmp_path / "references.bib"
    path.write_text(content)
    with pytest.raises(PaperError, match=rf"references\.bib.*{message}"):
        bibliography(source, path)


def test_no_citation_no_item(references):
    assert r"\bibitem" not in bibliography("text", references)
