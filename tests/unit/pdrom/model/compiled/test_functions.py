"""Compiled functions: one compilation by one process, and few kinds of arguments."""

import os
import subprocess
import sys
from pathlib import Path

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.compiled import functions
from pdrom.model.dynamics import frames
from pdrom.model.runs import trajectory


def doubled(number):
    return 2.0 * number


def test_a_process_waits_for_another_that_compiles_the_same_function(tmp_path, monkeypatch):
    """While this process waits for the lock, the other one compiles and ends."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    program = "import test_functions as t; t.functions.compiled(t.doubled)(4.0)"
    variables = {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}

    def other_process(*_lock: object) -> None:
        command, folder = [sys.executable, "-c", program], Path(__file__).parent
        subprocess.run(command, env={**os.environ, **variables}, cwd=folder, check=True)

    monkeypatch.setattr(functions, "flock", other_process)
    made = functions.compiled(doubled)
    assert made(3.0) == 6.0
    assert (made.stats.cache_hits.total(), made.stats.cache_misses.total()) == (1, 0)


def test_loops_are_compiled_once_whatever_a_scene_holds():
    """Nothing, one end, or two overlapping ends, with matrices of either index type."""
    before = set(frames._frames.overloads)
    right = {"effect": "pins", "select": "right"}
    for effects in ((), (LEFT,), (LEFT, right, {**right, "select": "top"})):
        trajectory(make_scene(GRAVITY, *effects, {"effect": "spring", "weight": 1e3}, frames=2))
    assert len(set(frames._frames.overloads) - before) <= 1
