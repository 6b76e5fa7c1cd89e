"""Jobs run the code that the run has planned: forked, alone, or started by another job."""

import json
import os
import runpy
import subprocess
import sys

import pytest

from pdrom.model.compiled import functions
from study.artifact.planned import KEPT, plan
from study.pipeline.fork_server import SUPPORTED, interpreter

MODULE = "pdrom.core.errors"


@pytest.mark.parametrize(
    ("first", "command"),
    [
        pytest.param(
            "from study.pipeline.fork_server import start_server; start_server(['h5py'])",
            f"{interpreter()} job.py",
            marks=pytest.mark.skipif(not SUPPORTED, reason="no safe forks on this platform"),
        ),
        ("", f"{interpreter()} job.py"),
        ("", f"{sys.executable} -m study.artifact.planned {MODULE}"),
    ],
    ids=["a fork of the server", "without a server", "a process of a job"],
)
def test_a_job_imports_what_the_plan_has_read(first, command, tmp_path):
    """The file in ``src`` has another text all the time; the second job finds compiled code."""
    (tmp_path / "job.py").write_text(f"import {MODULE}")
    planned = tmp_path / "plan.json"
    for word in ("planned", "planned again"):
        text = f"print('{word}', __file__)"
        path, _ = plan()[0][MODULE]
        planned.write_text(json.dumps([{**plan()[0], MODULE: (path, text)}, {}]))
        code = f"import subprocess; {first}\nfor _ in 'ab': subprocess.run({command!r}, shell=True)"
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, KEPT: str(planned)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stdout == 2 * f"{word} {path}\n", done.stderr


def test_a_kernel_has_another_name_if_a_file_beside_it_has_another_text(tmp_path):
    """Of equal size and date: Numba's cache would not see the difference."""
    names, path = set(), tmp_path / "kernel.py"
    kernel = "from pdrom.model.compiled.functions import compiled\n@compiled\ndef f(): return "
    for number in "12":
        path.write_text(kernel + number)
        os.utime(path, (0, 0))
        functions._checksum.cache_clear()
        names.add(runpy.run_path(str(path))["f"].py_func.__qualname__)
    assert len(names) == 2
