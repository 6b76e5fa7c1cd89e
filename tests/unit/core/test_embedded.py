"""Figures, the manuscript and HDF5 files carry what made them."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from pdrom.core.embedded import embedded
from pdrom.core.provenance import made_by, provenance
from pdrom.core.store import provenance_of, write_hdf5
from pdrom.report.figures.kit.output import write_figure
from pdrom.report.paper.tex import build_pdf

TEX = r"""\documentclass{article}\usepackage[T1]{fontenc}\usepackage{lmodern}
\usepackage[hidelinks]{hyperref}\InputIfFileExists{provenance.tex}{}{}
\begin{document}Text\end{document}"""


def write(kind: str, folder: Path) -> Path:
    """A file of a kind, made by the job at work."""
    path = folder / f"f.{kind}"
    match kind:
        case "h5":
            with write_hdf5(path) as file:
                file["x"] = [1.0]
        case "tex.pdf":
            (folder / "main.tex").write_text(TEX)
            build_pdf(folder / "main.tex", path, [])
        case _:
            figure = Figure(figsize=(1, 1))
            write_figure(figure, r"a (title) \ with signs", folder / "f.pdf", folder / "f.png")
    return path


@pytest.mark.parametrize("kind", ["h5", "pdf", "png", "tex.pdf"])
def test_what_made_a_file_is_inside_it_and_in_its_seal(kind, tmp_path):
    with made_by("ladder", {"r": [6, 10], "words": "a (b) c"}, "c0de"):
        path, expected = write(kind, tmp_path), provenance()
    assert expected["made_by"] == "ladder"
    assert embedded(path) == provenance_of(path) == expected


def test_a_file_without_a_record_has_none(tmp_path):
    for name, content in {"f.pdf": b"%PDF /Keywords (words)", "f.csv": b"a\n1\n"}.items():
        (tmp_path / name).write_bytes(content)
        assert embedded(tmp_path / name) == provenance_of(tmp_path / name) == {}
