"""Full-order runs and reductions of every hard case.

A reduction does not fail, or `hard_cases.expected` has the reason.

In exact arithmetic, the objective of a frame falls in every iteration. Computed values may rise for
two reasons, with the unit round-off u and a constant c. Errors up to c u (|y| + |s|) of y - s, and
up to c u (|S| |y| + |p|) of S y - p, change a value E by up to 2 sqrt(E R) + R, where R is the
objective of these errors. A Cholesky solve has a residual |r| <= c u |A| |y| (Higham 2002, theorem
10.4), so that it misses the minimum by up to |r|^2 / (2 lambda_min(A)).
"""

from collections.abc import Sequence
from functools import cache
from itertools import cycle
from typing import Any

import numpy as np
import pytest

from pdrom.core.errors import PdromError
from pdrom.core.yamlfile import read_yaml
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.forces import Gravity
from pdrom.model.metrics import shape_residuals
from pdrom.model.runs import followed
from pdrom.model.scene import Scene
from pdrom.reduction.method import load_methods
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import reduced_state
from places import CONFIG
from study.experiments.hard_cases import outcomes
from study.experiments.hard_cases.catalogue import HardCase, cases, start_of

METHODS = load_methods(CONFIG / "methods.yaml")
EXPECTED = outcomes.HardCases(**read_yaml(CONFIG / "default.yaml")["hard_cases"]).expected
CASES, REDUCTIONS = cases(), outcomes.names(METHODS)
SUBSPACES = [name for name in REDUCTIONS if name not in METHODS]
EPS, OPERATIONS = np.finfo(float).eps, 32.0  # u, and c: a few errors for each entry in a row


@cache
def training(case: str) -> outcomes.Training:
    return outcomes.Training(CASES[case])


def rises(loop: Stepper, scene: Scene, state: State, basis: Any = None) -> tuple[list[State], bool]:
    """States of all frames, and whether the objective rises by more than rounding errors explain.

    ``basis`` (N, K) are the columns of a subspace; the states are coordinates in it.
    """
    h, states, risen = loop.time_step, [state], False
    rows = np.asarray(abs(scene.system.matrix).sum(axis=1)).ravel()
    for frame in range(scene.config.frames):
        before = states[-1]
        after, report = loop.step(before, frame)
        states.append(after)
        a = loop.space.acceleration(before.positions, before.velocities)
        s = before.positions + h * before.velocities + h**2 * a
        largest = np.max(np.abs([before.positions, s, after.positions]), axis=0)
        size = largest if basis is None else np.abs(basis) @ largest
        unit = OPERATIONS * EPS * (float(size.max()) + float(np.abs(scene.mesh.points).max()))
        noise = 1.5 * float(scene.masses.sum()) / h**2 * (2.0 * unit) ** 2
        for group in scene.groups:
            sums = np.asarray(abs(group.S).sum(axis=1)).ravel()
            noise += 1.5 * float(group.row_weights @ (2.0 * sums * unit) ** 2)
        allowed = 2.0 * np.sqrt(abs(report.objective[0]) * noise) + noise
        if basis is None:
            least = float(scene.system.inertia.min())
            allowed += 1.5 * float((unit * rows) @ (unit * rows)) / least
        else:
            allowed += of_dense_solve(loop, scene, basis, largest, unit * rows)
        risen |= bool(np.diff(report.objective).max(initial=0.0) > allowed)
    return states, risen


def of_dense_solve(loop: Any, scene: Scene, b: np.ndarray, z: np.ndarray, r: np.ndarray) -> float:
    """B^T maps residuals r to |B|^T r; the explicit inverse adds errors c u cond(A) |z|."""
    matrix = b.T @ (scene.masses[:, None] * b) / loop.time_step**2
    matrix = matrix + sum(step.matrix for step in loop.local_steps)
    scale = np.sqrt(np.diag(matrix))  # with a unit diagonal, units of z have no effect
    values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    least, greatest = max(values[0], EPS * values[-1]), values[-1]
    error = OPERATIONS * EPS * greatest / least * float(np.linalg.norm(scale[:, None] * z))
    residual = (np.abs(b).T @ r) / scale
    return float(1.5 * (residual @ residual) / least + 0.5 * greatest * error**2)


def is_free(scene: Scene) -> bool:
    """Whether nothing but gravity acts on the body as a whole."""
    others = (*scene.boundaries, *scene.contacts)
    return not others and all(isinstance(force, Gravity) for force in scene.forces)


def keeps_momentum(scene: Scene, positions: np.ndarray, v: np.ndarray) -> bool:
    """Whether only gravity changes the momentum, up to rounding errors of S^T W p and solver."""
    h, masses = scene.config.time_step, scene.masses
    pull = sum((f.acceleration(positions[0], v[0]) for f in scene.forces), np.zeros(3))
    found = np.einsum("n,fna->fa", masses, v)
    expected = found[0] + np.arange(len(v))[:, None] * h * masses.sum() * pull
    size = float(np.abs(positions).max()) + float(np.abs(v).max()) * h
    noise = EPS * OPERATIONS * size * (masses.sum() / h + h * abs(scene.system.matrix).sum())
    return bool(np.abs(found - expected).max() <= noise * max(1.0, np.sqrt(len(v))))


def energy_grows(scene: Scene, positions: np.ndarray, velocities: np.ndarray) -> bool:
    """Whether the energy grows: from rest it cannot, because the implicit step damps."""
    energies = []
    for q, v in zip(positions, velocities, strict=True):
        groups = [group.for_run() for group in scene.groups]
        for group in groups:
            group.begin_frame(q)
        potential = sum(group.accumulate(q, np.zeros_like(q)) for group in groups)
        energies.append(0.5 * float(scene.masses @ (v**2).sum(axis=1)) + potential)
    elastic = float(np.abs(positions).max()) ** 2 * float(abs(scene.system.matrix).sum())
    return max(energies) > energies[0] * (1.0 + 1e-9) + EPS * OPERATIONS * elastic


def reach(scene: Scene, positions: np.ndarray) -> float:
    """Longest side (m) of the boxes around rest shape, start and fixed vertices of any frame."""
    held = np.unique(np.concatenate([[], *(b.vertices for b in scene.boundaries)]).astype(int))
    moved = np.ptp(positions[:, held], axis=1).max() if len(held) else 0.0
    return max(scene.mesh.extent, float(np.ptp(positions[0], axis=0).max()), float(moved))


# Cases whose bodies end at rest in their rest shape, up to 1 % of their extent.
RECOVER = ("inverted_strain", "inverted_rotation", "inverted_uneven", "one_tetrahedron",
           "one_iteration_inverted")  # fmt: skip
STILL = ("half_turn_strain", "half_turn_tetrahedron", "half_turn_rotation", "volume_sheared",
         "area_sheared", "nothing_free")  # fmt: skip
SPRING, LEFT = {"effect": "spring", "weight": 1e6}, {"effect": "pins", "select": "left"}
LONG = {
    "held": HardCase("", "sheet", [SPRING, {"effect": "gravity"}, LEFT]),
    "free": HardCase("", "bar", [{"effect": "tetrahedron_strain", "weight": 1e6}],
                     {"mapped": [1.4, 0.8, -0.9]}),
}  # fmt: skip


def check_full_order(name: str, case: HardCase, scene: Scene) -> None:
    start = start_of(scene, **case.start)
    states, risen = rises(scene.stepper(), scene, start)
    q, v = (np.stack([getattr(s, k) for s in states]) for k in ("positions", "velocities"))
    assert np.array_equal(q, followed(scene.stepper(), start, scene.config.frames))
    assert np.isfinite(q).all()
    assert np.isfinite(v).all()
    assert np.ptp(q, axis=1).max() <= case.bound * reach(scene, q)
    assert not risen
    if is_free(scene) and name != "far_away":
        assert keeps_momentum(scene, q, v)
        # bending uses the normals at the beginning of the frame, so that its energy may grow
        if not scene.forces and not v[0].any() and scene.config.groups != ["bending"]:
            assert not energy_grows(scene, q, v)
    if name in RECOVER:
        residuals, scale = shape_residuals(scene.mesh.points[None], q[-1:], scene.masses)
        assert scale[0] * np.linalg.norm(residuals, axis=2).max() <= 1e-2 * scene.mesh.extent
    if name in STILL:
        assert np.abs(q - q[0]).max() <= 1e-9 * np.abs(q[0]).max()


@pytest.mark.parametrize("name", CASES)
def test_a_full_order_run_is_bounded_and_conserves_momentum(name):
    check_full_order(name, CASES[name], CASES[name].scene())


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_a_run_of_two_thousand_frames_is_bounded_and_conserves_momentum(name):
    check_full_order(name, LONG[name], LONG[name].scene().changed(frames=2000))


@pytest.mark.parametrize(
    ("effects", "settings"),
    [
        ([SPRING | {"weight": 1e16}], {"time_step": 1.0}),  # translations are below rounding
        ([SPRING], {"vertex_mass": 1e-12}),  # masses are below rounding errors of the stiffness
        ([SPRING, LEFT, {"effect": "translate", "select": "left", "offset": [1, 0, 0], "over": 5}],
         {}),  # pins and a handle prescribe different positions of the same vertices
        ([SPRING, {"effect": "self_collision", "thickness": 0.0}], {}),
    ],
)  # fmt: skip
def test_a_case_that_cannot_be_solved_is_refused(effects, settings):
    case = HardCase("", "sheet", effects, settings=settings)
    with pytest.raises(PdromError):
        rises(case.scene().stepper(), case.scene(), start_of(case.scene(), mapped=[1.1, 1, 1]))


# The experiment `hard_cases` runs all pairs and `./reproduce verify` compares their table: only one
# reduction for each case, another one for the next case, is not slow.
def pairs(reductions: Sequence[str]) -> list[Any]:
    return [
        pytest.param(name, each, marks=[pytest.mark.slow] if (i - j) % len(reductions) else [])
        for i, name in enumerate(CASES)
        for j, each in enumerate(reductions)
    ]


@pytest.mark.parametrize(("name", "reduction"), pairs(REDUCTIONS))
def test_a_reduction_fails_exactly_where_the_configuration_expects_it(name, reduction):
    found = outcomes.row(training(name), reduction, METHODS, EXPECTED)
    expected = EXPECTED.get(reduction, outcomes.Expectation(why="it never fails anywhere"))
    if found["outcome"] not in (outcomes.HOLDS, outcomes.NOTHING, outcomes.NOT_TAKEN):
        assert name in (*expected.fails, *expected.may_fail), found["outcome"]
    else:
        assert name not in expected.fails, found["outcome"]
        assert found["frames"] in (0, training(name).scene.config.frames)


@pytest.mark.parametrize(("name", "reduction"), pairs(SUBSPACES))
def test_the_objective_never_rises_in_a_subspace(name, reduction):
    own = training(name)
    if not taken(name):
        return
    model = outcomes.reduced_model(own, reduction, METHODS)
    assert isinstance(model, SubspaceModel)
    loop, start = model.loop(own.scene)[0], reduced_state(own.scene, model.columns, own.start)
    tracked = Stepper(loop.space, loop.time_step, loop.iterations, local_steps=loop.local_steps)
    assert not rises(tracked, own.scene, start, model.columns.B)[1]


@pytest.mark.parametrize(
    ("name", "reduction"),
    list(zip(cycle(["scrambled_sheet", "bar_plane_rotation"]), REDUCTIONS, strict=False)),
)
def test_two_runs_give_the_same_bits(name, reduction):
    """Also the momentum is conserved: internal forces S^T W p sum to zero for any projections p."""
    own = training(name)
    model = outcomes.reduced_model(own, reduction, METHODS)
    first, again = (outcomes.reduced_run(own, model) for _ in range(2))
    assert np.array_equal(first.positions, again.positions)
    v = np.diff(first.positions, axis=0, prepend=own.start.positions[None])
    assert keeps_momentum(own.scene, first.positions, v / own.scene.config.time_step)


def taken(name: str) -> bool:
    """Whether a position subspace accepts all effects of a case."""
    return all(EFFECTS.load(effect["effect"]).in_subspace for effect in CASES[name].effects)


# For each effect, the first case that a subspace accepts and the first that it refuses.
FIRST = {
    (effect["effect"], taken(name)): name
    for name in reversed(CASES)
    for effect in CASES[name].effects
}


@pytest.mark.parametrize("name", sorted({*FIRST.values()}))
def test_a_subspace_accepts_exactly_the_effects_that_support_it(name):
    """The error of a subspace names the effect; methods in vertex positions accept all effects."""
    for reduction in ("pod-full", "pod"):
        found = outcomes.row(training(name), reduction, METHODS, EXPECTED)
        assert (found["outcome"] == outcomes.NOT_TAKEN) == (
            reduction == "pod-full" and not taken(name)
        )
        if found["outcome"] == outcomes.NOT_TAKEN:
            assert "effect '" in found["why"]


def test_expectations_name_reductions_that_exist():
    assert set(EXPECTED) <= set(REDUCTIONS)
