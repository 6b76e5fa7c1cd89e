"""Jobs run the code that the run has planned: forked, alone, or started by another job."""

import json
import os
import subprocess
import sys

import pytest

from study.artifact.planned import KEPT, plan
from study.pipeline.fork_server import SUPPORTED, interpreter

MODULE = "pdrom.core.errors"
SERVER = "from study.pipeline.fork_server import start_server\nstart_server(['h5py'])\n"
OWNER = "import subprocess\nfor _ in 'ab': subprocess.run({!r}, shell=True)"
CHILD = f"{sys.executable} -m study.artifact.planned {MODULE}"


@pytest.mark.parametrize(
    ("first", "job"),
    [(SERVER * SUPPORTED, f"{interpreter()} job.py"), ("", f"{interpreter()} job.py"), ("", CHILD)],
    ids=["a fork", "without a server", "a process of a job"],
)
def test_a_job_imports_what_the_plan_has_read(first, job, tmp_path):
    """The file in ``src`` has another text all the time; the second job finds compiled code."""
    (tmp_path / "job.py").write_text(f"import {MODULE}")
    path, kept = plan()[0][MODULE][0], tmp_path / "plan.json"
    for word in ("planned", "planned again"):
        text = f"print('{word}', __file__)"
        kept.write_text(json.dumps([{**plan()[0], MODULE: (path, text)}, {}]))
        done = subprocess.run(
            [sys.executable, "-c", first + OWNER.format(job)], cwd=tmp_path,
            env={**os.environ, KEPT: str(kept)}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stdout == 2 * f"{word} {path}\n", done.stderr
