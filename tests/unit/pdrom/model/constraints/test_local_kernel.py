"""Kernels in two parts: the split of large groups is only a matter of order."""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, make_scene
from pdrom.model.compiled import rows
from pdrom.model.constraints import local_kernel
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


@local_kernel.local_kernel
def _recording(y_place, rhs_place, record, part):
    """Adds 1 to the first number of each of its units; counts them, and the calls of each part."""
    entries = rows.indices(record, local_kernel.OWN + 1)
    rhs = rows.doubles(rhs_place, 4 * entries[local_kernel.VERTICES])
    notes = rows.doubles(entries[local_kernel.OWN], 3)
    notes[part] += 1.0
    if part == local_kernel.PREPARE:
        return 0.0
    for unit in range(entries[local_kernel.FIRST + part], entries[local_kernel.FIRST + part + 1]):
        rhs[4 * unit] += 1.0
    return float(entries[local_kernel.FIRST + part + 1] - entries[local_kernel.FIRST + part])


def recording(split: bool, prepares: bool) -> tuple[local_kernel.LocalKernel, np.ndarray]:
    """A kernel of five units that touch six vertices, and how often each part was called."""
    notes = np.zeros(3)
    touched = (lambda unit: np.arange(unit, 6)) if split else None
    return local_kernel.LocalKernel(_recording, 6, 5, [notes], [], touched, prepares), notes


@pytest.mark.parametrize("prepares", [True, False])
@pytest.mark.parametrize("split", [True, False])
def test_parts_cover_all_units_once(split, prepares):
    kernel, notes = recording(split, prepares)
    local, rhs = local_kernel.LocalPass([kernel]), np.full((6, 3), 5.0)
    assert bool(local.touched) == split
    for _ in range(3):
        assert local.accumulate(np.zeros((6, 3)), rhs) == 5.0
    expected = np.full((6, 3), 5.0)
    expected[:5, 0] += 3.0
    assert np.array_equal(rhs, expected)
    assert notes.tolist() == [3.0, 3.0 * split, 3.0 * prepares]


def test_a_pass_adds_all_its_kernels():
    kernels = [recording(split, False)[0] for split in (True, False, True)]
    rhs = np.zeros((6, 3))
    assert local_kernel.LocalPass(kernels).accumulate(np.zeros((6, 3)), rhs) == 15.0
    assert rhs[:, 0].tolist() == [3.0] * 5 + [0.0]


def test_a_group_without_a_kernel_writes_its_own_local_step():
    group = make_scene({"effect": "spring", "weight": 1.0}).groups[0]
    group.local_kernel = None
    with pytest.raises(NotImplementedError, match="spring"):
        group.accumulate(np.zeros((2, 3)), np.zeros((2, 3)))
