"""What git tracks: text and a few pictures, nothing large or binary by accident; the container."""

import re
import tomllib
from pathlib import Path

from packaging.specifiers import SpecifierSet

from pdrom.core.yamlfile import read_yaml
from places import ROOT, tracked
from study.artifact.paths import FIGURE, RESULTS, TABLE
from study.figures.kit.declaration import declarations
from study.pipeline.folders import Folders
from study.tables import declared

LARGEST = 300_000
# Binary files that are meant: pictures of the pages for readers, compressed tables.
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


def test_no_large_or_binary_file_is_tracked_or_about_to_be():
    files = tracked("--cached", "--others", "--exclude-standard")
    assert len(files) > 500
    assert [str(path.relative_to(ROOT)) for path in files if offends(path)] == []


def test_the_manifest_for_codecheckers_follows_version_2_and_names_what_the_study_makes():
    """https://raw.githubusercontent.com/codecheckers/register/master/rules-2.0.yml"""
    path = ROOT / "codecheck.yml"
    assert path.read_text("utf-8").startswith("---\n")
    content = read_yaml(path)
    assert content["version"] == "https://codecheck.org.uk/spec/config/2.0/"
    # the codechecker fills them in
    assert {"codechecker", "report", "summary", "certificate"} <= set(content)
    made = {TABLE.at(RESULTS, name=name) for name in declared()}
    made |= {FIGURE.at(RESULTS, name=name) for name in declarations()}
    made |= set(Folders().documents.values())
    assert {entry["file"] for entry in content["manifest"]} <= made


DOCKERFILE = (ROOT / "Dockerfile").read_text("utf-8")
IGNORED = (ROOT / ".dockerignore").read_text("utf-8").split()


def test_its_python_is_one_that_the_packages_have_wheels_for_and_the_script_does_the_rest() -> None:
    found = re.findall(r"^FROM python:(\d+)\.(\d+)-slim", DOCKERFILE, re.MULTILINE)
    assert len(found) == 1
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert SpecifierSet(project["requires-python"]).contains(".".join(found[0]))

    # its environment is made by the script alone
    assert "RUN ./reproduce run pdrom --help" in DOCKERFILE
    assert 'ENTRYPOINT ["./reproduce"]' in DOCKERFILE
    assert "pip" not in DOCKERFILE


def test_what_the_script_needs_is_not_left_out_of_it() -> None:
    needed = (
        "reproduce", "requirements.lock", "requirements-cluster.lock", "src", "config", "paper",
        "workflow", "tests",
    )  # fmt: skip
    assert not set(needed) & set(IGNORED)
    assert all((ROOT / name).exists() for name in needed)
    assert {".venv*", "results/*"} <= set(IGNORED)


def test_the_image_that_the_workflow_names_is_ignored_by_git_and_made_of_this_file() -> None:
    workflow = (ROOT / "workflow" / "Snakefile").read_text("utf-8")
    (image,) = re.findall(r'^container: "(.+)"$', workflow, re.MULTILINE)
    assert image in (ROOT / ".gitignore").read_text("utf-8").split()
    assert "docker build -t pdrom ." in DOCKERFILE
    assert f"apptainer build {image}" in workflow
