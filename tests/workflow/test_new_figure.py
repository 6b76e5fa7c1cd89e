"""A figure of one's own: two modules and a line of the manuscript, and the pipeline makes it."""

import pytest
import yaml
from checkout import Checkout, copy_repository

DECLARATION = '''"""Rest shapes."""

from pdrom.core.paths import MESH
from pdrom.core.reads import Chosen, Setting
from pdrom.report.figures.kit.declaration import Declaration
from pdrom.report.figures.kit.options import Scenes

FIGURE = Declaration(
    title="Rest shapes",
    caption="Vertices of each mesh, $N$ of them; errors above {stability.wrong} count as wrong.",
    reads=(Chosen(MESH), Setting("stability.wrong")),
    options=Scenes,
)
'''
DRAWING = '''"""Rest shapes."""

from matplotlib.figure import Figure

from pdrom.core.paths import MESH
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.kit.options import Scenes
from pdrom.report.figures.kit.results import NothingToDraw, Results


def draw(results: Results, options: Scenes) -> Figure:
    """A dot for each vertex."""
    figure = Figure(figsize=(2.0, 2.0))
    ax = figure.subplots()
    for scene in results.scenes(options):
        points = load_mesh(results.path(MESH, scene)).points
        ax.plot(points[:, 0], points[:, 1], ".", label=scene)
    if not ax.lines:
        raise NothingToDraw("no mesh")
    return figure
'''
FIGURES = "src/pdrom/report/figures"
STUDY = {
    "scenes": ["spring_oop"],
    "methods": ["deim"],
    "ranks": [4, "full"],
    "coarsen": {"resolution": 0.25, "frames": 0.05},
    "guard": {"cases": []},
}


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy with one more figure."""
    made = copy_repository(tmp_path_factory.mktemp("figure"))
    (made.folder / FIGURES / "rest_shapes.py").write_text(DECLARATION, encoding="utf-8")
    (made.folder / FIGURES / "drawings/rest_shapes.py").write_text(DRAWING, encoding="utf-8")
    made.edit("paper/main.tex", "\\figureof{ladder}", "\\figureof{ladder}\n\\figureof{rest_shapes}")
    (made.folder / "own.yaml").write_text(yaml.safe_dump(STUDY), encoding="utf-8")
    return made


def _planned(checkout: Checkout) -> str:
    planned = checkout.planned("--configfile", "own.yaml")
    (pdf,) = [path for path in planned if path.endswith("figures/rest_shapes.pdf")]
    return pdf


def test_a_new_figure_is_planned(checkout: Checkout) -> None:
    assert not (checkout.folder / _planned(checkout)).exists()


@pytest.mark.slow
def test_a_new_figure_is_drawn(checkout: Checkout) -> None:
    pdf = _planned(checkout)
    done = checkout.snakemake("--configfile", "own.yaml", "--", pdf)
    assert done.returncode == 0, done.stderr
    assert (checkout.folder / pdf).read_bytes().startswith(b"%PDF")
    assert (checkout.folder / pdf).with_suffix(".png").is_file()


def test_its_option_is_typed_without_another_line(checkout: Checkout) -> None:
    figures = checkout.folder / "config" / "figures.yaml"
    before = figures.read_text(encoding="utf-8")
    figures.write_text(before + "rest_shapes:\n  ranks: [6]\n", encoding="utf-8")
    done = checkout.snakemake("-n", "--configfile", "own.yaml")
    figures.write_text(before, encoding="utf-8")
    assert done.returncode != 0
    assert "rest_shapes: unknown key 'ranks' (allowed: scenes)" in done.stderr
