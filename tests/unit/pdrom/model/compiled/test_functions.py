"""A function is compiled by one process, and compiled loops have arguments of one type."""

import os
import subprocess
import sys

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.compiled import functions
from pdrom.model.dynamics import frames
from pdrom.model.runs import trajectory


def double(number):
    return 2.0 * number


def test_a_function_that_another_process_compiles_meanwhile_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    other = [sys.executable, "-c", "import test_functions as t; t.functions.compiled(t.double)(1)"]
    monkeypatch.setattr(functions, "flock", lambda *_: subprocess.check_call(other))
    made = functions.compiled(double)
    assert (made(3), made.stats.cache_hits.total()) == (6.0, 1)


def test_loops_are_compiled_once_for_all_scenes():
    before = set(frames._frames.overloads)
    for more in ((), (LEFT,), (LEFT, {**LEFT, "select": "right"}, {**LEFT, "select": "top"})):
        trajectory(make_scene(GRAVITY, *more, {"effect": "spring", "weight": 1e3}, frames=2))
    assert len(set(frames._frames.overloads) - before) <= 1
