"""Measure the peak memory of a process that only trains a reduced model."""

import subprocess
import sys

from places import CONFIG

TRAIN = """
import resource, sys
from pdrom.api import load_scene, run, train
train(run(load_scene(sys.argv[1])), modes=40)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""


def bench_memory_of_training(benchmark):
    """Train 40 modes of a bar of 8,000 vertices on converged frames; ``extra_info`` has the MB."""
    command = [sys.executable, "-c", TRAIN, str(CONFIG / "scenes" / "bar80.yaml")]
    said = benchmark.pedantic(lambda: subprocess.check_output(command, text=True), rounds=1)
    benchmark.extra_info["MB"] = float(said)
    assert float(said) < 1000.0
