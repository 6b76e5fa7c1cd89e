"""Jobs run the code that was planned: forked, in a new process, or started by another job."""

import json
import os
import subprocess
import sys

import pytest

from study.artifact.planned import KEPT, plan
from study.pipeline.fork_server import METHOD

MODULE = "pdrom.core.errors"
FORKED = """
from study.pipeline import fork_server
from snakemake.script import PythonScript
from types import SimpleNamespace
fork_server.METHOD = "{}"
fork_server.start_server("h5py")
for _ in "ab":
    PythonScript.execute_script(SimpleNamespace(container_img=None), "job.py")
"""
CHILD = f"""
import subprocess, sys
for _ in "ab":
    subprocess.run([sys.executable, "-m", "study.artifact.planned", "{MODULE}"])
"""


@pytest.mark.parametrize(
    "owner",
    [FORKED.format(METHOD), FORKED.format("spawn"), CHILD],
    ids=["a fork", "without a server", "a process of a job"],
)
def test_a_job_imports_the_code_that_the_plan_has_read(owner, tmp_path):
    """The file in ``src`` has another text meanwhile; the second job finds compiled code."""
    (tmp_path / "job.py").write_text(f"import {MODULE}")
    path, kept = plan()[MODULE][0], tmp_path / "plan.json"
    for word in ("planned", "planned again"):
        text = f"print('{word}', __file__)"
        kept.write_text(json.dumps([{**plan(), MODULE: (path, text)}, {}]))
        done = subprocess.run(
            [sys.executable, "-c", owner], cwd=tmp_path,
            env={**os.environ, KEPT: str(kept)}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stdout == 2 * f"{word} {path}\n", done.stderr
