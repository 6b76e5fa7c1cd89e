"""Scenes of a family and a size: one frame, the local step of each group, the global step.

A frame (K = 10 local/global iterations) of the full-order model runs plainly and with Anderson
acceleration; the local step is compiled, with the vectorised NumPy reference beside it; the global
step is its assembly with factorisation, and the solves of one iteration.
"""

from functools import cache

import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.api import load_scene, run, train
from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.scene import Scene
from places import ROOT
from study.experiments.timing import NumpyLocalStep

WEIGHTS = {
    "bending": 1e-2,
    "spring": 1e5,
    "strain": 1e5,
    "deformation_gradient": 1e8,
    "tetrahedron_strain": 1e6,
}


def held(*groups: str, **mesh: object) -> Scene:
    """A mesh under gravity whose left side is fixed."""
    effects = [{"effect": group, "weight": WEIGHTS[group]} for group in groups]
    return make_scene(GRAVITY, LEFT, *effects, mesh=mesh, frames=1)


def sheet(size: int, *groups: str, wave: float = 0.0) -> Scene:
    """Horizontal sheet of ``size`` x ``size`` vertices."""
    return held(*groups, kind="cloth", rows=size, columns=size, plane="xz", wave=wave)


def bar(nx: int, ny: int, nz: int, group: str) -> Scene:
    """Bar of nx x ny x nz vertices."""
    return held(group, kind="bar", nx=nx, ny=ny, nz=nz)


FAMILIES = {
    "springs 20x20": lambda: sheet(20, "spring"),
    "springs 100x100": lambda: sheet(100, "spring"),
    "strain 20x20": lambda: sheet(20, "strain"),
    "strain 100x100": lambda: sheet(100, "strain"),
    "bending 20x20": lambda: sheet(20, "bending", wave=0.1),
    "three groups 100x100": lambda: sheet(100, "bending", "spring", "strain"),
    "bar 40x5x5 rotations": lambda: bar(40, 5, 5, "deformation_gradient"),
    "bar 40x5x5 clamped": lambda: bar(40, 5, 5, "tetrahedron_strain"),
    "bar 80x10x10 rotations": lambda: bar(80, 10, 10, "deformation_gradient"),
    "bar 80x10x10 clamped": lambda: bar(80, 10, 10, "tetrahedron_strain"),
}

# scenes of one group that fit into the caches
KERNELS = [name for name in FAMILIES if "20x20" in name or "40x5x5" in name]


def twisted(points: np.ndarray, turn: float = 1.5) -> np.ndarray:
    """Points rotated about x by up to ``turn`` radians and stretched by 5 %, with a small noise.

    Hardly any element is left in its range, so that almost every element is projected.
    """
    angle = turn * (points[:, 0] - points[:, 0].min()) / np.ptp(points[:, 0])
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = (1.05 * points).T
    noise = np.random.default_rng(1).standard_normal(points.shape)
    return np.column_stack([x, c * y - s * z, s * y + c * z]) + 1e-4 * noise


WINDOWS = {"plain": 0, "accelerated": 5}


@pytest.mark.parametrize("kind", WINDOWS)
@pytest.mark.parametrize("family", FAMILIES)
def bench_frame(benchmark, family, kind):
    """Time frame 0 from rest, after the factorisation."""
    scene = FAMILIES[family]().changed(anderson_window=WINDOWS[kind])
    loop, start = scene.stepper(track_objective=False), scene.initial_state()
    benchmark.group = f"frame {family}"
    state, _ = benchmark(loop.step, start, 0)
    benchmark.extra_info["ms_per_iteration"] = round(
        1e3 * benchmark.stats.stats.min / scene.config.iterations, 4
    )
    assert np.isfinite(state.positions).all()


STEPS = {"compiled": lambda group: group.for_run(), "numpy": NumpyLocalStep}


@pytest.mark.parametrize("implementation", STEPS)
@pytest.mark.parametrize("family", KERNELS)
def bench_local_step(benchmark, family, implementation):
    """Time one `accumulate`; ns per element are in ``extra_info``."""
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


LARGE = [name for name in FAMILIES if "100x100" in name or "80x10x10" in name]


def fixed_of(scene: Scene, solver: str):
    """System and its fixed vertices at frame 0."""
    system = scene.system_with(solver)
    return system, scene.space(system).fixed(0, scene.initial_state().positions)[0]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("family", LARGE)
def bench_factorisation(benchmark, family, solver):
    """Time the assembly and factorisation of the system."""
    scene = FAMILIES[family]()

    def factorise() -> None:
        system, fixed = fixed_of(scene, solver)
        system.eliminate(fixed)

    benchmark.group = f"factorisation {family}"
    benchmark.pedantic(factorise, rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("family", FAMILIES)
def bench_solve(benchmark, family, solver):
    """Time the solves of three right-hand sides."""
    scene = FAMILIES[family]()
    system, fixed = fixed_of(scene, solver)
    elimination = system.eliminate(fixed)
    rhs = np.random.default_rng(1).standard_normal((scene.mesh.vertices, 3))
    y = np.zeros_like(rhs)
    benchmark.group = f"solve {family}"
    benchmark(elimination.solve, rhs, y)
    assert np.isfinite(y).all()


RUNS = {"full": (10, 0, None), "5": (5, 0, "local_global"), "newton": (1, 0, None)}
RUNS |= {f"anderson {k}": (k, 5, "local_global") for k in (20, 100, 400, 800)}


@cache
def trained(name):
    scene = load_scene(ROOT / "config" / "scenes" / f"{name}.yaml").changed(frames=40, reduce={})
    return scene, train(run(scene), modes=40, skinning=40 * (name == "strain_oop"))


@pytest.mark.parametrize("kind", RUNS)
@pytest.mark.parametrize("name", ["bar80", "sheet100_strain", "strain_oop", "spring_oop"])
def bench_reduced_run(benchmark, name, kind):
    """Time 40 frames with all positions; report the deformation error against converged frames."""
    scene, model = trained(name)
    own, solver, lift = scene.iterated(*RUNS[kind][:2]), RUNS[kind][2], model.reduced.positions
    loop, start = model.loop(own, solver=solver)
    if kind == "full":
        loop, start, lift = own.stepper(track_objective=False), own.initial_state(), np.copy
    benchmark.extra_info["distance"] = str(model.run(own, solver=solver).error(model.run(scene)))
    benchmark.group = f"run {name}"
    benchmark(lambda: [lift(state.positions) for state, _ in loop.run(start, range(40))])
