"""The global step: assembly with factorisation, and the solves of one iteration."""

import numpy as np
import pytest
from families import FAMILIES

from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.scene import Scene

LARGE = [name for name in FAMILIES if "100x100" in name or "80x10x10" in name]


def fixed_of(scene: Scene, solver: str):
    """System and its fixed vertices at frame 0."""
    system = scene.system_with(solver)
    return system, scene.space(system).fixed(0, scene.initial_state().positions)[0]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("family", LARGE)
def bench_factorisation(benchmark, family, solver):
    """From the constraint groups to a factorised system."""
    scene = FAMILIES[family]()

    def factorise() -> None:
        system, fixed = fixed_of(scene, solver)
        system.eliminate(fixed)

    benchmark.group = f"factorisation {family}"
    benchmark.pedantic(factorise, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("family", FAMILIES)
def bench_solve(benchmark, family, solver):
    """Three right-hand sides."""
    scene = FAMILIES[family]()
    system, fixed = fixed_of(scene, solver)
    elimination = system.eliminate(fixed)
    rhs = np.random.default_rng(1).standard_normal((scene.mesh.vertices, 3))
    y = np.zeros_like(rhs)
    benchmark.group = f"solve {family}"
    benchmark(elimination.solve, rhs, y)
    assert np.isfinite(y).all()
