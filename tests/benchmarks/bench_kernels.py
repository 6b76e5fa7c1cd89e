"""The local step of each group: compiled, and the vectorised NumPy reference beside it."""

import numpy as np
import pytest
from families import FAMILIES, KERNELS, twisted

from study.experiments.timing import NumpyLocalStep

STEPS = {"compiled": lambda group: group, "numpy": NumpyLocalStep}


@pytest.mark.parametrize("implementation", STEPS)
@pytest.mark.parametrize("family", KERNELS)
def bench_local_step(benchmark, family, implementation):
    """One `accumulate`; ns per element are in ``extra_info``."""
    scene = FAMILIES[family]()
    step = STEPS[implementation](scene.groups[0])
    y = twisted(scene.mesh.points)
    rhs = np.zeros_like(y)
    step.begin_frame(y)
    benchmark.group = family
    benchmark(step.accumulate, y, rhs)
    elements = scene.groups[0].elements
    benchmark.extra_info["elements"] = elements
    benchmark.extra_info["ns_per_element"] = round(1e9 * benchmark.stats.stats.min / elements, 1)
    assert np.isfinite(rhs).all()
