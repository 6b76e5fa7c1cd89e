"""Measure the iterations until ten frames of three materials have errors of 1 % (add ``-s``)."""

import sys
from itertools import pairwise

import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.model.dynamics.convergence import frame_error
from pdrom.model.runs import ConvergedStepper

BAR = {"kind": "bar", "nx": 9, "ny": 3, "nz": 3, "extent": 0.2}
SHEET = {"kind": "cloth", "rows": 10, "columns": 10, "plane": "xz", "extent": 0.5}
SOLID, CLOTH = {"effect": "deformation_gradient"}, {"effect": "strain", "thickness": 3e-4}
MATERIALS = {
    "rubber": (BAR, 1100, SOLID | {"young": 2e6, "poisson": 0.49}),
    "softer": (BAR, 1100, SOLID | {"young": 2e6, "poisson": 0.45}),
    "steel": (BAR, 7850, SOLID | {"young": 2e11, "poisson": 0.3}),
    "cotton": (SHEET, 0.15, CLOTH | {"young": 5e7, "poisson": 0.3}),
}


@pytest.mark.parametrize("step", [0.016, 1e-3])
@pytest.mark.parametrize("name", MATERIALS)
def bench_iterations_of_a_material(benchmark, name, step):
    mesh, density, group = MATERIALS[name]
    keys = {"masses": [{"density": density}], "frames": 10, "time_step": step}
    scene = make_scene(GRAVITY, LEFT, group, mesh=mesh, **keys)
    best = ConvergedStepper(scene, scene.system, 1e-13 if name == "steel" else 1e-10, 200_000)
    states = [scene.initial_state()]
    states += [state for state, _ in best.run(states[0], range(10))]

    def worst(count: int, window: int) -> float:
        loop, own = scene.iterated(count, window).stepper(), (scene.masses, scene.mesh.extent)
        frames = enumerate(pairwise(states))
        ends = [(loop.step(begin, k)[0], end, begin) for k, (begin, end) in frames]
        return max(frame_error(*(state.positions for state in each), *own) for each in ends)

    def needed(window: int) -> int:
        low, high = 0, 1
        while high <= 10_000 and worst(high, window) > 0.01:
            low, high = high, 2 * high
        while high <= 10_000 and high - low > max(1, high // 50):
            middle = (low + high) // 2
            low, high = (middle, high) if worst(middle, window) > 0.01 else (low, middle)
        return high

    found = benchmark.pedantic(lambda: [needed(window) for window in (0, 10)], rounds=1)
    sys.stdout.write(f"\n{name}, {step} s: {found[0]} plain, {found[1]} accelerated iterations\n")
