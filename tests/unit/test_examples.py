"""The examples of the documentation run, are short, and make their pictures."""

import matplotlib.image
import pytest

from places import EXAMPLES, ROOT

PAGE = (ROOT / "docs" / "library.md").read_text("utf-8")


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_an_example_is_short_makes_its_picture_and_is_on_the_page(path, tmp_path, monkeypatch):
    text, picture = path.read_text("utf-8"), path.with_suffix(".png")
    assert len(text.splitlines()) <= 40
    monkeypatch.chdir(tmp_path)
    exec(compile(text, path.name, "exec"), {})
    for file in (tmp_path / picture.name, picture):
        assert matplotlib.image.imread(file).std() > 0.01
    assert {f"(examples/{file.name})" in PAGE for file in (path, picture)} == {True}
