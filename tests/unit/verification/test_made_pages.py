"""Pages for readers are what the declarations say; one command writes them."""

from pathlib import Path

import pytest

from pdrom.report.figures.kit.catalogue import declarations
from pdrom.verification.pages import written as module
from places import ROOT


@pytest.fixture(scope="module")
def made() -> dict[Path, str]:
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(ROOT)
        return module.pages()


def test_the_pages_are_up_to_date(made):
    old = [str(p) for p, text in made.items() if (ROOT / p).read_text("utf-8") != text]
    assert old == [], "run ./reproduce pages"


def test_every_figure_is_listed(made):
    figures = made[Path("docs/figures.md")]
    assert [name for name in declarations() if f"## `{name}`" not in figures] == []


def test_only_what_is_out_of_date_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module, "pages", lambda: {Path("a/x"): "new\n", Path("y"): "same\n"})
    Path("y").write_text("same\n")
    before = Path("y").stat().st_mtime_ns
    module.main()
    assert capsys.readouterr().out == "written: a/x\n"
    assert (Path("a/x").read_text(), Path("y").stat().st_mtime_ns) == ("new\n", before)
    module.main()
    assert capsys.readouterr().out == "written: nothing, all are up to date\n"
