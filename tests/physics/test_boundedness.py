"""Bounded projections keep every run bounded (theorem 1 of the manuscript)."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, Pushing, make_scene
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects.base import held_vertices
from pdrom.model.scene import Scene
from study.experiments.hard_cases.outcomes import BOUNDED

SHEET = {"kind": "cloth", "rows": 4, "columns": 3}
BAR = {"kind": "bar", "nx": 3, "ny": 2, "nz": 2}
MESHES = {"spring": SHEET, "strain": SHEET, "bending": SHEET, "deformation_gradient": BAR}
FRAMES, ITERATIONS = 16, 2
SCENES = 150
RIGHT = {"effect": "pins", "select": "right"}
MOVED = {"effect": "translate", "select": "left", "over": 6, "offset": [0.3, 0.0, 0.2]}
HOLDS: list[list[dict]] = [
    [],
    [LEFT],
    [LEFT, RIGHT],
    [{**LEFT, "until": 9}],
    [{**LEFT, "until": 5}, {**RIGHT, "start": 3}],
    [{**MOVED, "start": 4, "until": 12}],
    [{"effect": "rotate", "select": "left", "axis": "x", "degrees": 90.0, "over": 8}],
    [{"effect": "poke", "over": 4, "rest": 1, "count": 3}],
]


def largest_projections(group: ConstraintGroup, points: np.ndarray) -> np.ndarray:
    """Bound (e,) of | p_e |_F over all states: rest lengths, or singular values allowed."""
    if group.manifold == "clamped":
        largest = float(group.kernel_parameters()[-1])
        return np.full(group.elements, np.sqrt(min(group.rows_per_element, 3)) * largest)
    return np.linalg.norm((group.S @ points).reshape(group.elements, -1), axis=1)


def always_free(scene: Scene) -> np.ndarray | None:
    """Vertices that are never fixed; None if the set of fixed vertices changes."""
    held = [held_vertices(scene.boundaries, f) for f in range(scene.config.frames)]
    if not all(np.array_equal(h, held[0]) for h in held):
        return None
    return np.setdiff1d(np.arange(scene.mesh.vertices), held[0])


def kept_velocity(scene: Scene) -> np.ndarray:
    """D = 1 - h c, (N,): share of the difference of two velocities that remains after a frame."""
    rates = sum((np.zeros(scene.mesh.vertices) + f.rate for f in scene.forces), np.zeros(1))
    return np.ones(scene.mesh.vertices) - scene.config.time_step * rates


def growth(angles: np.ndarray, frames: int) -> float:
    """alpha of the theorem over ``frames``, from tan(angles) = h omega."""
    m = np.arange(frames)[:, None]
    return float(
        np.max(
            np.sin(angles) * np.cos(angles) ** m * np.abs(np.sin((m + 1) * angles)), axis=1
        ).sum()
    )


def modes(scene: Scene, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 (k,) > 0 and modes (n, k) of the stiffness and the masses of ``free`` vertices."""
    stiffness = scene.groups[0].system_matrix().toarray()[np.ix_(free, free)]
    root = 1.0 / np.sqrt(scene.masses[free])
    squares, vectors = np.linalg.eigh(root[:, None] * stiffness * root)
    moving = squares > 1e-9 * squares[-1]
    return squares[moving], root[:, None] * vectors[:, moving]


def differences(scene: Scene, draw) -> np.ndarray:
    """|e|_K (F,) after each frame of two runs, with the forces of ``draw`` and without."""
    ends = []
    for forces in (draw, lambda: 0.0):
        loop = scene.stepper(local_steps=[Pushing(forces)], track_objective=False)
        state, positions = scene.initial_state(), []
        for frame in range(scene.config.frames):
            state, _ = loop.step(state, frame)
            positions.append(state.positions)
        ends.append(np.stack(positions))
    stiffness = scene.groups[0].system_matrix()
    return np.array([np.sqrt(np.sum(e * (stiffness @ e))) for e in ends[0] - ends[1]])


def allowed(scene: Scene) -> np.ndarray:
    """Largest |e_n|_K over beta after each frame (F,), by the theorem."""
    frames, free = scene.config.frames, always_free(scene)
    bound = np.sqrt(np.arange(1.0, frames + 1))
    if free is not None and (kept_velocity(scene) == 1.0).all():
        angles = np.arctan(scene.config.time_step * np.sqrt(modes(scene, free)[0]))
        bound = np.minimum(bound, growth(angles, frames) if len(angles) else 0.0)
    return bound


def random_scene(rng: np.random.Generator) -> Scene:
    """Scene with masses over two decades, random forces with a rate, and one of `HOLDS`."""
    group, h = str(rng.choice(list(MESHES))), float(10.0 ** rng.uniform(-2.5, -1.0))
    effects = [GRAVITY] if rng.random() < 0.5 else []
    if rng.random() < 0.3:
        effects.append({"effect": "damping", "rate": rng.uniform(0.0, 0.99) / h})
    if rng.random() < 0.3:
        effects.append({"effect": "drag", "coefficient": 10.0 ** rng.uniform(-1.0, 4.0)})
    effects += HOLDS[rng.integers(len(HOLDS))]
    effects.append({"effect": group, "weight": float(10.0 ** rng.uniform(1.0, 6.0))})
    scene = make_scene(
        *effects, mesh=MESHES[group], frames=FRAMES, time_step=h, iterations=ITERATIONS
    )
    masses = 10.0 ** rng.uniform(-1.0, 1.0, scene.mesh.vertices)
    return Scene.build(scene.config, scene.mesh, masses=masses)


def random_forces(scene: Scene, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Forces (2 F, N, 3) of projections of each iteration, and the largest norm of them in K^+.

    The forces are random, or excite one mode in resonance, which gives the largest difference.
    """
    (group,) = scene.groups
    stiffness = group.system_matrix().toarray()
    free = always_free(scene)
    free = np.arange(len(stiffness)) if free is None else free
    squares, vectors = modes(scene, free)
    if rng.random() < 0.4 or len(squares) == 0:
        p = rng.standard_normal((ITERATIONS * FRAMES, group.S.shape[0], 3))
        forces = np.stack([group.S.T @ (group.row_weights[:, None] * one) for one in p])
    else:
        mode = rng.integers(min(3, len(squares)))
        angle = np.arctan(scene.config.time_step * np.sqrt(squares[mode]))
        field = np.zeros((len(stiffness), 3))
        field[free] = vectors[:, [mode]] * rng.standard_normal(3)
        signs = np.sign(np.sin(np.arange(FRAMES, 0, -1) * angle)).repeat(ITERATIONS)
        forces = signs[:, None, None] * (stiffness @ field)
    inverse = np.linalg.pinv(stiffness[np.ix_(free, free)], rcond=1e-11, hermitian=True)
    norms = [np.sqrt(np.sum(f[free] * (inverse @ f[free]))) for f in forces]
    return forces, float(max(norms))


def test_the_bound_of_the_theorem_holds_for_random_scenes_and_is_nearly_reached():
    """Masses, forces, fixed vertices and projections are random; a resonant mode comes close."""
    used: list[float] = []
    for seed in range(2 * SCENES):
        if len(used) == SCENES:
            break
        rng = np.random.default_rng(seed)
        scene = random_scene(rng)
        if np.abs(kept_velocity(scene)).max() <= 1.0:
            forces, beta = random_forces(scene, rng)
            push = iter(forces)
            energy = differences(scene, lambda push=push: next(push))
            used.append(float((energy / (allowed(scene) * beta + 1e-300)).max()))
    assert len(used) == SCENES
    assert 0.9 < max(used) <= 1.0 + 1e-6


@pytest.mark.parametrize("tangent", [0.1, 0.3, 3.0])
def test_a_mode_driven_in_resonance_grows_by_the_closed_formula(tangent):
    """A force with the sign of the response drives a mode; reference: the recursion of a frame."""
    m, angle = np.arange(2000), np.arctan(tangent)
    answer = np.sin(angle) * np.cos(angle) ** m * np.sin((m + 1) * angle)
    x, before = 0.0, 0.0
    for sign in np.sign(answer[::-1]):  # (1 + t^2) x'' - 2 x' + x = t^2 with static solution 1
        x, before = (2.0 * x - before + tangent**2 * sign) / (1.0 + tangent**2), x
    assert x == pytest.approx(growth(np.array([angle]), len(m)), rel=1e-9)
    closed = 1.0 / np.tan(angle / 2.0)
    assert 0.6 * closed < x <= closed


@pytest.mark.parametrize("group", sorted(GROUPS))
def test_no_projection_is_larger_than_its_bound(group, rng):
    scene = make_scene({"effect": group, "weight": 1.0}, mesh=GROUPS[group])
    g, points = scene.group(group).for_run(), scene.mesh.points
    if g.manifold not in BOUNDED:
        # projections that keep their size, or name no set, have no bound
        assert g.manifold in ("size", None)
        return
    for spread in (1e-3, 1.0, 1e3):
        q = points + spread * rng.standard_normal(points.shape)
        g.begin_frame(q)
        norms = np.linalg.norm(g.project(q).reshape(g.elements, -1), axis=1)
        assert (norms <= largest_projections(g, points) * (1 + 1e-12)).all()
