"""Kernels in two parts: the split of large groups is only a matter of order."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, make_scene
from pdrom.model.effects import EFFECTS
from pdrom.model.scene import Scene

SPLIT = [name for name in sorted(GROUPS) if hasattr(EFFECTS.load(name), "split_from")]


def group_of(name: str, split: bool, monkeypatch: pytest.MonkeyPatch):
    """A group that counts as large or not, on a mesh of several blocks."""
    mesh = {**GROUPS[name], "rows": 9, "columns": 8} if "rows" in GROUPS[name] else GROUPS[name]
    scene = make_scene({"effect": name, "weight": 1e4}, mesh=mesh)
    monkeypatch.setattr(type(scene.groups[0]), "split_from", 2 if split else 10**9)
    return Scene.build(scene.config, scene.mesh)


@pytest.mark.parametrize("name", SPLIT)
def test_parts_change_the_order_of_summation_only(name, rng, monkeypatch):
    whole, split = (group_of(name, s, monkeypatch) for s in (False, True))
    y = whole.mesh.points + 0.05 * rng.standard_normal(whole.mesh.points.shape)
    sums = []
    for scene in (whole, split):
        rhs = np.zeros_like(y)
        group = scene.groups[0]
        assert bool(group.local_kernel.touched) == (scene is split)
        group.begin_frame(y)
        sums.append((group.accumulate(y, rhs), rhs))
    assert sums[0][0] == pytest.approx(sums[1][0], rel=1e-13)
    assert np.abs(sums[0][1] - sums[1][1]).max() <= 1e-13 * np.abs(sums[0][1]).max()


def test_compiled_iterations_add_both_parts(monkeypatch):
    """All groups of a scene, several frames: without the compiled loop each adds its own parts."""
    mesh = {"kind": "cloth", "rows": 9, "columns": 8, "plane": "xz", "wave": 0.1}
    effects = [{"effect": name, "weight": 1e3} for name in ("bending", "spring", "strain")]
    scene = make_scene(GRAVITY, LEFT, *effects, mesh=mesh)
    for group in scene.groups:
        monkeypatch.setattr(type(group), "split_from", 2)
    scene = Scene.build(scene.config, scene.mesh)
    assert all(group.local_kernel.touched for group in scene.groups)
    compiled, plain = scene.stepper(scene.system), scene.stepper(scene.system)
    assert compiled._compiled is not None
    plain._compiled = plain._whole = None
    states = [scene.initial_state(), scene.initial_state()]
    for frame in range(5):
        states = [
            loop.step(state, frame)[0]
            for loop, state in zip((compiled, plain), states, strict=True)
        ]
    moved = np.abs(states[0].positions - scene.mesh.points).max()
    assert np.abs(states[0].positions - states[1].positions).max() <= 1e-11 * moved


def test_a_group_without_a_kernel_writes_its_own_local_step():
    group = make_scene({"effect": "spring", "weight": 1.0}).groups[0]
    group.local_kernel = None
    with pytest.raises(NotImplementedError, match="spring"):
        group.accumulate(np.zeros((2, 3)), np.zeros((2, 3)))
