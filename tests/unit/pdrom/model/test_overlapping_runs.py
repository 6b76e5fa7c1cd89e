"""Runs of one scene that overlap in time equal separate runs bit for bit, for every effect.

No test depends on a race: if runs share memory, one run changes that of a run that waits.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, make_scene
from holdings_of_scenes import arrays
from pdrom import api
from pdrom.model.dynamics.stepper import State
from pdrom.model.effects import EFFECTS
from pdrom.model.runs import followed
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.subspace.hrpd import HrpdSpec, hrpd, sampled_space
from pdrom.reduction.subspace.model import Samples, SubspaceModel
from pdrom.reduction.subspace.training import make_columns

FRAMES, LAG = 10, 6
SAMPLED = HrpdSpec(dimension=6, samples=20)
LATE = {"select": [0, 1, 2], "start": 3}
# An entry of each effect that acts in these frames.
ACTING: dict[str, dict] = {
    "gravity": {"acceleration": [0, -3, 1]}, "damping": {"rate": 1}, "drag": {"coefficient": 1},
    "wind": {"velocity": [0, 5, 5]}, "floor": {"height": 1.9}, "plane": {"point": [0, 1.9, 0]},
    "sphere": {"centre": [0, 1, 0], "radius": 1}, "box": {"lower": [-1, 0, -1], "upper": [1, 2, 1]},
    "self_collision": {"thickness": 0.3}, "kick": {"speed": 3, "seed": 1}, "pins": LATE,
    "velocity": {"value": [0, 1, 2]}, "translate": {**LATE, "over": 4, "offset": [0, 0.5, 0]},
    "rotate": {**LATE, "over": 4, "axis": "x", "degrees": 90},
    "keyframes": {**LATE, "keys": [{"at": 4, "offset": [0, 0.4, 0], "turn": [0, 40, 0]}]},
    "poke": {"over": 3, "rest": 1, "count": 3}, **{group: {"weight": 1e4} for group in GROUPS},
}  # fmt: skip


def scene_with(effect):
    others = ["pins"] if effect in GROUPS else ["spring", "bending"]
    listed = [{"effect": name, **ACTING[name]} for name in (effect, "kick", *others)]
    mesh = GROUPS.get(effect, {**GROUPS["bending"], "plane": "xz"})
    return make_scene(GRAVITY, *listed, mesh=mesh, frames=FRAMES)


def loops_of(scene, kind):
    """Function that makes a step loop and its initial state; loops share as much as runs may."""
    if kind in ("supernodal", "splu"):
        own, system = scene.iterated(5, 3), scene.system_with(kind)
        return lambda: (own.stepper(system), own.initial_state())
    full, group, spec = api.run(scene), scene.groups[-1], api.methods()["gappy"]
    if kind == "reduced":
        made = api.basis(full, group.name, spec)
        step = ReducedLocalStep(group, Reduction(made, select(made, spec, 3), spec, r=3))
        steps = replace_group(scene, group.name, step)
        return lambda: (scene.stepper(scene.system, steps), scene.initial_state())
    columns, samples = make_columns([scene], full.positions[1:], 3), {}
    for each in scene.groups:
        few, space = np.arange(0, each.elements, 3), sampled_space(each, scene.mesh.points, SAMPLED)
        weighted = Samples(few, np.full(len(few), 3.0))
        samples[each.name] = weighted if kind == "subspace" else hrpd(each, columns, space)
    return lambda: SubspaceModel(columns, samples).loop(scene)


@pytest.mark.parametrize("kind", ["supernodal", "splu", "reduced", "subspace", "interpolated"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_a_run_writes_neither_to_its_scene_nor_to_another_run(effect, kind):
    """Two runs take turns. One is a few frames behind and gets a new loop for every frame."""
    if kind in ("subspace", "interpolated") and not EFFECTS.load(effect).in_subspace:
        pytest.skip("needs all vertices")
    scene = scene_with(effect)
    made = loops_of(scene, kind)
    first, start = made()
    starts = [start, State(1.01 * start.positions, start.velocities)]
    expected = [followed(made()[0], each, FRAMES) for each in starts]
    found = [[state] for state in starts]

    def contents():
        return {key: own.tobytes() for key, own in arrays([scene, first, found[0]]).items()}

    for frame in range(FRAMES + LAG):
        if frame < FRAMES:
            found[0].append(first.step(found[0][-1], frame)[0])
        if frame >= LAG:
            before = contents()
            found[1].append(made()[0].step(found[1][-1], frame - LAG)[0])
            assert contents() == before
    np.testing.assert_array_equal([[s.positions for s in states] for states in found], expected)


@pytest.mark.parametrize("effect", EFFECTS)
def test_runs_in_threads_equal_runs_one_after_the_other(effect):
    scene = scene_with(effect)
    alone, group = api.run(scene), scene.groups[-1].name
    model = api.train(alone, group=group, r=3)
    reduced = model.run(scene)
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(api.run, scene) for _ in range(3)]
        others = [pool.submit(model.run, scene) for _ in range(3)]
    for run, other in zip(runs, others, strict=True):
        np.testing.assert_array_equal(run.result().positions, alone.positions)
        np.testing.assert_array_equal(run.result().snapshots[group].p, alone.snapshots[group].p)
        np.testing.assert_array_equal(other.result().positions, reduced.positions)


def test_a_group_of_a_scene_refuses_data_of_a_run():
    (group,) = make_scene({"effect": "bending", "weight": 1.0}, mesh=GROUPS["bending"]).groups
    for call in (group.begin_frame, group.project, lambda y: group.accumulate(y, y.copy())):
        with pytest.raises(RuntimeError, match="bending: a scene's group has no frame"):
            call(np.zeros((42, 3)))
