"""The examples of the documentation: they run, are short, and each makes its picture."""

from pathlib import Path

import matplotlib.image
import pytest

from places import ROOT

EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_an_example_is_short_and_makes_its_picture(path: Path, tmp_path, monkeypatch):
    text = path.read_text("utf-8")
    assert len(text.splitlines()) <= 40
    monkeypatch.chdir(tmp_path)
    exec(compile(text, path.name, "exec"), {})
    for file in (tmp_path / f"{path.stem}.png", path.with_suffix(".png")):
        assert matplotlib.image.imread(file).std() > 0.01


def test_the_page_of_the_library_leads_through_the_examples():
    page = (ROOT / "docs" / "library.md").read_text("utf-8")
    assert len(EXAMPLES) == 6
    for path in EXAMPLES:
        assert f"(examples/{path.name})" in page
        assert f"(examples/{path.stem}.png)" in page
