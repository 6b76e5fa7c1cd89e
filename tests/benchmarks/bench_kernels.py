"""The local step of each group: compiled, and the vectorised NumPy reference beside it."""

import numpy as np
import pytest
from families import FAMILIES, KERNELS, twisted

from pdrom.reduction.subspace.model import Output
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


@pytest.mark.parametrize("call", ["output", "product", "copy"])
def bench_vertices(benchmark, call):
    """Positions of 10,000 vertices from 44 columns, beside the product in double and a copy."""
    rng = np.random.default_rng(0)
    B, z = rng.standard_normal((10_000, 44)), rng.standard_normal((44, 3))
    output = Output(B)
    made = output(z)
    other = np.empty_like(made)
    calls = {
        "output": lambda: output(z),
        "product": lambda: B @ z,
        "copy": lambda: np.copyto(other, made),
    }
    benchmark.group = "vertices"
    benchmark(calls[call])
