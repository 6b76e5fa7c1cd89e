"""The page of a comparison, as text and in a headless browser."""

import pytest

from browser import page_at
from pdrom.verification.studies.findings import Findings
from pdrom.verification.studies.page import page
from pdrom.verification.studies.sides import Side
from pdrom.verification.studies.times import ratios


@pytest.fixture
def written(study, frames, tmp_path):
    """The page of two studies that differ in a table, a figure and a time."""
    worse = {
        "ladder": frames["ladder"].assign(condition=2 * frames["ladder"].condition),
        "local_share": frames["local_share"].assign(local_ms=5.0),
    }
    folders = study("a"), study("b", worse, code="3" * 64, grey=7)
    findings = Findings(*(Side.read(folder, tmp_path) for folder in folders))
    lines = findings.lines()
    path = tmp_path / "page.html"
    path.write_text(page(findings, lines, ratios(findings.comparisons)), encoding="utf-8")
    return path


def test_texts_of_a_study_are_no_markup(written):
    text = written.read_text("utf-8")
    assert "a &lt;processor&gt;" in text
    assert "<processor>" not in text
    assert "{{" not in text


@pytest.mark.parametrize("width", [1280, 360])
def test_the_page_is_whole_and_fits_its_window(written, width):
    with page_at(written.as_uri(), width, 800) as shown:
        assert shown.said == []
        assert [each for each in shown.asked if not each.startswith("data:")] == [written.as_uri()]
        assert shown.inner_text("#outcome").startswith("2 of ")
        assert shown.locator("img").count() == 2
        assert all(shown.locator("img").nth(i).bounding_box() for i in range(2))
        assert shown.evaluate("document.documentElement.scrollWidth") <= width
        assert "local_share local_ms\t2.5 (2.5 to 2.5)" in shown.inner_text("#times")
        shown.emulate_media(color_scheme="dark")
        assert (
            shown.evaluate("getComputedStyle(document.body).backgroundColor")
            != "rgb(255, 255, 255)"
        )
