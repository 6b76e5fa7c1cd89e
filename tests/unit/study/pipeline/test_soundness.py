"""Set-up: linear algebra is tried as jobs do it."""

import subprocess
import sys

import numpy as np
import pytest

from study.pipeline.soundness import compare

# A NumPy that ends the process in the product of one shape, as the kernels of OpenBLAS 0.3.34 do.
STAND_IN = """
import os, signal
import numpy as np
from pdrom.core import environment
from study.pipeline import soundness
class Broken(np.ndarray):
    def __matmul__(self, other):
        if self.shape == (25, 900):
            os.kill(os.getpid(), signal.SIGSEGV)
        return np.asarray(self) @ np.asarray(other)
make = np.random.default_rng
class Random:
    def standard_normal(self, shape):
        return make(1).standard_normal(shape).view(Broken)
np.random.default_rng = lambda seed: Random()
soundness.main()
"""


def test_the_calculation_that_ends_the_process_is_the_last_one_named():
    done = subprocess.run(
        [sys.executable, "-c", STAND_IN], capture_output=True, text=True, check=False
    )
    assert done.returncode < 0
    last = done.stdout.splitlines()[-1]
    assert last == "numpy: X.T @ (2 * X) with X of 900 x 25"
    assert "Segmentation fault" in done.stderr


@pytest.mark.parametrize("wrong", [np.nan, 1 + 1e-6, np.inf])
def test_a_wrong_result_is_refused(wrong):
    compare(np.ones(3) + 1e-14, np.ones(3))
    with pytest.raises(SystemExit, match="wrong"):
        compare(np.array([1.0, wrong, 1.0]), np.ones(3))
