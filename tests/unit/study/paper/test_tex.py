"""Built PDFs are complete and have the same bytes everywhere; errors have one line."""

import shutil

import pytest

from pdrom.core.errors import PaperError
from pdrom.core.store import checksum_path
from study.paper.tex import build_pdfs

DOCUMENT = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage{lmodern}
\pdftrailerid{}
\begin{document}
\section{One}\label{sec:one}
Section \ref{sec:one} and \cite{key}. \input{part}
\begin{thebibliography}{9}
\bibitem{key} An entry.
\end{thebibliography}
\end{document}
"""


def project(folder, text=DOCUMENT):
    (folder / "generated").mkdir(parents=True)
    (folder / "generated" / "part.tex").write_text("Part.")
    source = folder / "main.tex"
    source.write_text(text)
    return source


def test_the_output_folder_contains_only_the_pdf(tmp_path):
    output = tmp_path / "out" / "main.pdf"
    build_pdfs({project(tmp_path): output}, [tmp_path / "generated"])
    assert output.read_bytes().startswith(b"%PDF-")
    assert sorted(output.parent.iterdir()) == [checksum_path(output), output]
    assert {path.name for path in tmp_path.iterdir()} == {"main.tex", "generated", "out"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Section", r"\nosuchcommand Section", r"! Undefined control sequence.* l\.7"),
        (r"\input{part}", r"\input{gone}", r"! LaTeX Error: File `gone.tex' not found"),
        (r"\ref{sec:one}", r"\ref{sec:two}", r"undefined references: sec:two"),
        (r"\cite{key}", r"\cite{other} \ref{a}", r"undefined references: a, other"),
        (r"\documentclass{article}", r"\documentclass{article}\usepackage{no-such-package}",
         r"no-such-package.sty' not found|needed packages"),
        (r"\end{document}", "", r"main\.tex"),
        ("Section", r"\rule{2\textwidth}{1pt} Section", r"1 boxes do not fit: Overfull \\hbox"),
        ("Section", r"\parbox{1cm}{\rule{1cm}{2\textheight}} Section",
         r"1 boxes do not fit: Overfull \\vbox"),
        ("Section", r"\begin{table}\rule{1cm}{2\textheight}\end{table}", r"Float too large"),
    ],
)  # fmt: skip
def test_a_fault_gives_one_line_and_leaves_the_old_pdf(tmp_path, old, new, message):
    source = project(tmp_path, DOCUMENT.replace(old, new))
    output = tmp_path / "main.pdf"
    output.write_bytes(b"old")
    with pytest.raises(PaperError, match=message) as caught:
        build_pdfs({source: output}, [tmp_path / "generated"])
    assert str(source) in str(caught.value)
    assert output.read_bytes() == b"old"


LINKED = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage{lmodern}
\usepackage{xr-hyper}
\usepackage{hyperref}
\externaldocument{%s}[%s.pdf]
\pdftrailerid{}
\pdfobjcompresslevel=0
\begin{document}
\section{Own}\label{sec:%s} See \ref{sec:%s}. %s
\end{document}
"""


def linked(folder, end="End."):
    """Two sources that refer to each other, with their PDFs."""
    for own, other in (("main", "supplement"), ("supplement", "main")):
        text = LINKED % (other, other, own, other, end if own == "main" else "End.")
        (folder / f"{own}.tex").write_text(text)
    return {folder / f"{n}.tex": folder / f"{n}.pdf" for n in ("main", "supplement")}


def test_documents_refer_to_each_other(tmp_path):
    documents = linked(tmp_path)
    build_pdfs(documents, [])
    for other, pdf in zip(("supplement", "main"), documents.values(), strict=True):
        assert f"/F({other}.pdf)/S/GoToR".encode() in pdf.read_bytes()
    before = [pdf.read_bytes() for pdf in documents.values()]
    build_pdfs(documents, [])
    assert [pdf.read_bytes() for pdf in documents.values()] == before


def test_a_document_with_too_many_pages_is_refused_and_no_pdf_is_written(tmp_path):
    documents = linked(tmp_path, r"\newpage Next.")
    with pytest.raises(PaperError, match=r"main\.tex: 2 pages, at most 1 are allowed"):
        build_pdfs(documents, [], {"main": 1})
    assert not any(pdf.exists() for pdf in documents.values())
    build_pdfs(documents, [], {"main": 2})


def test_tex_cannot_run_shell_commands(tmp_path):
    text = DOCUMENT.replace("Section", rf"\immediate\write18{{touch {tmp_path}/made}}")
    build_pdfs({project(tmp_path, text): tmp_path / "main.pdf"}, [tmp_path / "generated"])
    assert not (tmp_path / "made").exists()


def test_a_machine_without_tex_gets_the_reason(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr("study.paper.tex.find_spec", lambda name: None)
    with pytest.raises(PaperError, match="no pdflatex with the needed packages on PATH"):
        build_pdfs({project(tmp_path): tmp_path / "main.pdf"}, [])
