"""Operations that compiled code executes, against those that its source says."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from numba import carray, types

from builders import make_scene
from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import Callback
from pdrom.model.constraints.lanes import LANES
from pdrom.model.constraints.local_kernel import LocalPass
from study.experiments.roofline.counted_kernel import counting, operations
from study.experiments.roofline.counters import Counted, Operations

SIGNATURE = types.float64(types.CPointer(types.float64), types.intp)


def _norms(place, count):
    """Sum of the lengths of vectors of three numbers over the largest."""
    x = carray(place, (3 * count,))
    total, largest = 0.0, 0.0
    for i in range(count):
        a, b, c = x[3 * i], x[3 * i + 1], x[3 * i + 2]
        length = np.sqrt(a * a + b * b + c * c)
        total += length
        if length > largest:
            largest = length
    return total / largest if largest > 0.0 else 0.0


@pytest.mark.parametrize("count", [0, 1, 4, 5, 17])
def test_a_loop_counts_what_its_source_says(count, rng):
    counted = Counted(Callback(_norms, SIGNATURE))
    call = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_int64)(counted.address)
    x = rng.standard_normal((count, 3))
    for _ in range(2):
        counted.reset()
        found = call(x.ctypes.data, count)
        assert counted.operations == Operations(6 * count, min(count, 1), count)
    lengths = np.linalg.norm(x, axis=1)
    assert found == pytest.approx(lengths.sum() / lengths.max() if count else 0.0)


def test_counted_kernels_do_what_the_kernels_do(group_scene, rng):
    """With the same bits, and whole blocks of lanes at work."""
    group = group_scene.groups[0]
    if group.local_kernel is None:
        pytest.skip("not compiled")
    y = group_scene.mesh.points + 0.05 * rng.standard_normal(group_scene.mesh.points.shape)
    group.begin_frame(group_scene.mesh.points)
    executed = operations(group.local_kernel, y)
    assert executed.flops >= 10 * group.elements
    counted = counting(group.local_kernel.function)
    counted.reset()
    own, other = np.zeros((2, rows.WIDTH * len(y)))
    energies = [
        LocalPass([kernel]).add(rows.flat(y), out, 1)
        for kernel, out in (
            (group.local_kernel, own),
            (replace(group.local_kernel, function=counted), other),
        )
    ]
    assert energies[0] == energies[1]
    assert (own == other).all()
    assert counted.operations == executed


def test_an_edge_costs_a_division_and_a_root():
    scene = make_scene({"effect": "spring", "weight": 1e5})
    group = scene.groups[0]
    executed = operations(group.local_kernel, 1.1 * scene.mesh.points)
    lanes = -(-group.elements // LANES) * LANES
    assert (executed.divisions, executed.roots) == (lanes, lanes)
    # edge 4, its square 5, p 3, S q - p 3 with its square 5 and energy 2, force 3, on two rows 8
    assert 0 <= executed.flops - 33 * lanes <= 16  # and the sum of the energies
