"""docs/figures.md is what the declarations say."""

from pdrom.report.document import PAGE, figures_page
from pdrom.report.figures.kit.catalogue import declarations
from places import ROOT


def test_the_page_is_up_to_date():
    assert (ROOT / PAGE).read_text(encoding="utf-8") == figures_page(ROOT)


def test_every_figure_is_listed():
    page = figures_page(ROOT)
    assert all(f"## `{name}`" in page for name in declarations())
