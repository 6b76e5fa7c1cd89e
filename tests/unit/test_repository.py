"""Git tracks text and a few pictures, no large or other binary file; files for containers."""

from pathlib import Path

from pdrom.core.yamlfile import read_yaml
from places import ROOT, tracked
from study.artifact.paths import FIGURE, RESULTS, TABLE
from study.figures.kit.declaration import declarations
from study.pipeline.folders import Folders
from study.tables import declared

LARGEST = 300_000
# Intended binary files: pictures of the pages for readers, compressed tables.
BINARY = (
    "docs/*.png", "docs/examples/*.png", "results/reference/tables/*.xz",
    "results/reference/studies/*/tables/*.xz",
)  # fmt: skip


def offends(path: Path) -> bool:
    inside = path.relative_to(ROOT)
    binary = b"\0" in path.read_bytes()[:8000]
    return path.stat().st_size > LARGEST or (
        binary and not any(inside.match(pattern) for pattern in BINARY)
    )


def test_no_large_or_binary_file_is_tracked_or_untracked():
    files = tracked("--cached", "--others", "--exclude-standard")
    assert len(files) > 500
    assert [str(path.relative_to(ROOT)) for path in files if offends(path)] == []


def test_the_manifest_for_codecheckers_follows_version_2_and_lists_the_outputs():
    """https://raw.githubusercontent.com/codecheckers/register/master/rules-2.0.yml"""
    path = ROOT / "codecheck.yml"
    assert path.read_text("utf-8").startswith("---\n")
    content = read_yaml(path)
    assert content["version"] == "https://codecheck.org.uk/spec/config/2.0/"
    # the codechecker fills in these entries
    assert {"codechecker", "report", "summary", "certificate"} <= set(content)
    made = {TABLE.at(RESULTS, name=name) for name in declared()}
    made |= {FIGURE.at(RESULTS, name=name) for name in declarations()}
    made |= set(Folders().documents.values())
    assert {entry["file"] for entry in content["manifest"]} <= made
