"""The container: same script, same lock file, a Python that the packages have wheels for."""

import re

from places import ROOT
from study.pipeline.platforms import NEWEST, OLDEST

DOCKERFILE = (ROOT / "Dockerfile").read_text("utf-8")
IGNORED = (ROOT / ".dockerignore").read_text("utf-8").split()


def test_its_python_is_one_that_the_packages_have_wheels_for_and_the_script_does_the_rest() -> None:
    found = re.findall(r"^FROM python:(\d+)\.(\d+)-slim", DOCKERFILE, re.MULTILINE)
    assert len(found) == 1
    assert OLDEST <= tuple(map(int, found[0])) <= NEWEST

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
