"""Training of reduced models: time, and the largest memory of a process that only trains."""

import subprocess
import sys

import pytest

from places import CONFIG

TRAIN = """
import resource, sys
from pdrom.api import load_scene, run, train
scene = load_scene(sys.argv[1])
model = train(run(scene), modes=int(sys.argv[2]))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""
MOST = {"bar80": 1000.0}  # MB, with 40 modes


@pytest.mark.parametrize("scene", MOST)
def bench_memory_of_training(benchmark, scene):
    """A full-order run, its frames converged, and 40 modes; MB are in ``extra_info``."""
    command = [sys.executable, "-c", TRAIN, str(CONFIG / "scenes" / f"{scene}.yaml"), "40"]

    def trained() -> float:
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return float(done.stdout.split()[-1])

    found = benchmark.pedantic(trained, rounds=1)
    benchmark.extra_info["MB"] = found
    assert found < MOST[scene]
