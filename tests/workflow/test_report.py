"""The report of a run opens in a real browser without a network, with all figures and tables."""

from collections.abc import Iterator

import numpy as np
import pytest
import yaml
from checkout import copy_repository
from PIL import Image
from playwright.sync_api import Page
from sandbox import MICRO, MICRO_FILE

from browser import browser_or_skip, page_at
from places import MICRO_RESULTS
from study.figures.kit.declaration import declarations
from study.tables import declared

ARGUMENTS = ("--configfile", MICRO_FILE)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A report whose figures have different widths, with the messages and requests of its page."""
    browser_or_skip()
    checkout = copy_repository(tmp_path_factory.mktemp("report"))
    (checkout.folder / MICRO_FILE).write_text(yaml.safe_dump(MICRO), encoding="utf-8")
    checkout.count_as_finished(*ARGUMENTS)
    for width, name in enumerate(declarations(), 1):
        picture = checkout.folder / MICRO_RESULTS / "figures" / f"{name}.png"
        Image.fromarray(np.full((1, width), 127, dtype=np.uint8)).save(picture)
    done = checkout.snakemake("--report", "report.html", *ARGUMENTS)
    assert done.returncode == 0, done.stderr
    with page_at((checkout.folder / "report.html").as_uri(), width=1500, height=900) as page:
        yield page


def go_to(page: Page, entry: str) -> None:
    """Open a category from any page of the report."""
    page.reload()
    page.get_by_role("link", name=entry, exact=True).click()


def test_every_figure_of_the_report_opens(opened):
    go_to(opened, "Figures")
    rows = opened.locator("tbody tr")
    shown = [row.split()[0] for row in rows.all_inner_texts()]
    assert sorted(shown) == sorted(declarations())
    for place, name in enumerate(shown):
        rows.nth(place).locator('[iconname="eye"]').click()
        width = list(declarations()).index(name) + 1
        opened.wait_for_function(f"[...document.images].some(i => i.naturalWidth === {width})")


def test_the_report_opens_without_a_network_and_without_an_error(opened):
    go_to(opened, "Tables")
    text = opened.inner_text("body")
    assert [t.name for t in declared().values() if t.title not in text] == []
    # Snakemake includes a script that prints advice on building it
    assert [said for said in opened.said if "tailwindcss" not in str(said)] == []
    go_to(opened, "Statistics")  # a chart of Snakemake, which prints advice on its scales
    opened.locator("svg, canvas").last.wait_for()
    assert [url for url in opened.asked if not url.startswith(("file:", "data:", "blob:"))] == []
