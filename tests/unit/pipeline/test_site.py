"""The site of the pages: what README leads to, with links that hold."""

import re
import subprocess
from pathlib import Path

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline import site
from places import ROOT


def test_every_page_is_part_of_the_site(tmp_path):
    found = site.collect(ROOT, tmp_path)
    pages = {path.relative_to(ROOT) for path in (ROOT / "docs").rglob("*.md")}
    assert pages | {Path("README.md"), Path("config/README.md"), Path("LICENSE")} <= set(found)
    for path in found:
        assert (tmp_path / path).read_bytes() == (ROOT / path).read_bytes()


def test_pages_of_an_earlier_site_and_circles_do_no_harm(tmp_path):
    (tmp_path / "README.md").write_text("[a](docs/a.md#part), [out](https://example.org/b.md)\n")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "a.md").write_text("[back](../README.md)\n")
    target = tmp_path / "site"
    (target / "docs").mkdir(parents=True)
    (target / "docs" / "old.md").touch()
    assert site.collect(tmp_path, target) == [Path("README.md"), Path("docs/a.md")]
    assert {path.name for path in target.rglob("*.md")} == {"README.md", "a.md"}


@pytest.mark.parametrize("link", ["docs/none.md", "../outside.md"])
def test_a_link_that_leads_nowhere_is_named(tmp_path, link):
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "outside.md").touch()
    (root / "README.md").write_text(f"[x]({link})\n")
    with pytest.raises(ConfigurationError, match=rf"README.md: the link {link} leads to no file"):
        site.collect(root, root / "site")


def test_what_cannot_be_installed_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    site.LOCK.write_text("mkdocs==0.0.0 --hash=sha256:00\n")
    assert site.main() == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("pdrom: docs: MkDocs cannot be installed (")
    assert not (site.TOOLS / site.LOCK.name).exists()


def test_an_environment_that_is_there_is_used(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("it is installed again"))
    site.LOCK.write_text("mkdocs==1\n")
    site.TOOLS.mkdir(parents=True)
    (site.TOOLS / site.LOCK.name).write_text("mkdocs==1\n")
    assert site.install() == site.TOOLS / "bin" / "python"


def test_the_site_lies_where_git_looks_not_and_the_lock_has_hashes():
    settings = read_yaml(ROOT / "mkdocs.yml")
    assert Path(settings["docs_dir"]) == site.PAGES
    assert f"{settings['site_dir']}/" in (ROOT / ".gitignore").read_text("utf-8").splitlines()
    lines = (ROOT / site.LOCK).read_text("utf-8").split("\n    ")
    pinned = re.findall(r"^[a-z0-9-]+==\S+", (ROOT / site.LOCK).read_text("utf-8"), re.MULTILINE)
    assert len(pinned) > 10
    assert sum("--hash=sha256:" in line for line in lines) > len(pinned)
