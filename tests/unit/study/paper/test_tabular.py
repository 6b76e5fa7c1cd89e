"""Tables of the manuscript are set by TeX, with rows and without."""

import pytest

from study.paper.tex import build_pdfs
from study.paper.textables import longtable, tabular

PAGE = r"""\documentclass{article}\usepackage[T1]{fontenc}\usepackage{lmodern}\usepackage{longtable}
\newcommand{\captionrow}{\caption{Table}\\}\begin{document}%s\end{document}"""


@pytest.mark.parametrize("form", [tabular, longtable])
@pytest.mark.parametrize("rows", [[], [["a", "1"]], [["a", "1"], ["b", "2"]]])
def test_a_table_is_set(form, rows, tmp_path):
    """A table without rows is that of a configuration which holds nothing of what it shows."""
    (tmp_path / "main.tex").write_text(PAGE % form(["name", "number"], rows, "lr"))
    build_pdfs({tmp_path / "main.tex": tmp_path / "main.pdf"}, [])
    assert (tmp_path / "main.pdf").read_bytes().startswith(b"%PDF")
