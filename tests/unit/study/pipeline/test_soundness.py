"""Set-up: linear algebra is tried as jobs do it."""

import subprocess
import sys

import pytest

# A NumPy that ends the process in the product of one shape, as the kernels of OpenBLAS 0.3.34 do,
# or makes a small error in it.
STAND_IN = """
import os, signal, sys
import numpy as np
from study.pipeline import soundness
class Broken(np.ndarray):
    def __matmul__(self, other):
        product = np.asarray(self) @ np.asarray(other)
        if self.shape == (25, 900) and sys.argv[1] == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        return product * (1.0 if self.shape != (25, 900) else float(sys.argv[1]))
make = np.random.default_rng
class Random:
    def standard_normal(self, shape):
        return make(1).standard_normal(shape).view(Broken)
np.random.default_rng = lambda seed: Random()
soundness.main()
"""


@pytest.mark.parametrize("fault", ["crash", "nan", "1.000001"])
def test_the_matrix_of_a_calculation_that_crashes_or_is_wrong_is_named_last(fault):
    command = [sys.executable, "-c", STAND_IN, fault]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode < 0) == (fault == "crash")
    assert done.returncode != 0
    assert done.stdout.splitlines()[-1].endswith("X of 900 x 25")
    assert ("Segmentation fault" if fault == "crash" else "wrong") in done.stderr
