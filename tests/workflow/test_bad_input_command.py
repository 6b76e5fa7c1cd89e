"""Broken input ends the command with one line, a failure, no traceback and no job.

One fault for each place at which the command reads input: a file that Snakemake merges, the plan,
``--config``, and a file that ``./reproduce`` checks before Snakemake reads it. The messages of all
others are those of the corpus, which `bad_input.test_bad_input` reads without a process.
"""

import pytest
from checkout import copy_repository, only_line
from sandbox import MICRO_FILE, Sandbox

from bad_input.cases import CASES
from bad_input.project import make_project

BY_NAME = {case.name: case for case in CASES}


@pytest.mark.parametrize(
    "name", ["template that runs code", "mesh of mixed cells", "scene that leaves the folder"]
)
def test_broken_input_of_the_corpus(name, tmp_path):
    case = BY_NAME[name]
    checkout = copy_repository(tmp_path)
    make_project(tmp_path, case.changes)
    settings = [f"{key}={value}" for key, value in case.overrides.items()]
    done = checkout.snakemake(*(["--config", *settings] if settings else []))
    assert done.returncode != 0
    line = only_line(done.stdout + done.stderr)
    assert [p for p in case.parts if not any(q in line for q in p.split("|"))] == [], line
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("content", "expected"),
    [(None, "no such configuration file"), (b"__use_yte__: true\n", "templates are not allowed")],
)
def test_a_broken_file_of_the_user(content, expected, tmp_path):
    """As ``./reproduce --configfile FILE``; Snakemake itself shows a traceback for some of them."""
    sandbox = Sandbox.make(tmp_path / "run")
    sandbox.path(MICRO_FILE).unlink()
    if content is not None:
        sandbox.path(MICRO_FILE).write_bytes(content)
    status, output = sandbox.run()
    assert status != 0
    line = only_line(output)
    assert line.startswith(f"pdrom: {MICRO_FILE}: ")
    assert expected in line
