"""Two threads give the bits of one, and the split of large groups is only a matter of order."""

import threading

import numpy as np
import pytest

from conftest import GROUPS, make_scene
from pdrom.model.constraints.parts import Parts
from pdrom.model.effects import EFFECTS
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene

GRAVITY = {"effect": "gravity"}
SPLIT = [name for name in sorted(GROUPS) if hasattr(EFFECTS.load(name), "split_from")]


def group_of(name: str, split: bool, monkeypatch: pytest.MonkeyPatch):
    """A group that counts as large or not, on a mesh of several blocks."""
    scene = make_scene({"effect": name, "weight": 1e4}, mesh=GROUPS[name])
    monkeypatch.setattr(type(scene.groups[0]), "split_from", 2 if split else 10**9)
    return Scene.build(scene.config, scene.mesh)


@pytest.mark.parametrize("name", SPLIT)
def test_two_threads_give_the_bits_of_one(name, rng, monkeypatch):
    scene = group_of(name, True, monkeypatch)
    group, points = scene.groups[0], scene.mesh.points
    assert group._parts.count == 2
    for size in (0.0, 1e-3, 1.0):
        y = points + size * rng.standard_normal(points.shape)
        group.begin_frame(y)
        start = rng.standard_normal(points.shape)
        results = []
        for threads in (1, 2):
            group.threads = threads
            rhs = start.copy()
            energies = [group.accumulate(y, rhs) for _ in range(20)]
            assert len(set(energies)) == 1
            results.append((energies[0], rhs))
        assert results[0][0] == results[1][0]
        assert np.array_equal(results[0][1], results[1][1])


@pytest.mark.parametrize("name", SPLIT)
def test_parts_change_the_order_of_summation_only(name, rng, monkeypatch):
    whole, split = (group_of(name, s, monkeypatch) for s in (False, True))
    y = whole.mesh.points + 0.05 * rng.standard_normal(whole.mesh.points.shape)
    sums = []
    for scene in (whole, split):
        rhs = np.zeros_like(y)
        scene.groups[0].begin_frame(y)
        sums.append((scene.groups[0].accumulate(y, rhs), rhs))
    assert sums[0][0] == pytest.approx(sums[1][0], rel=1e-13)
    assert np.abs(sums[0][1] - sums[1][1]).max() <= 1e-13 * np.abs(sums[0][1]).max()


def test_a_run_with_two_threads_is_the_run_with_one(monkeypatch):
    """All groups of a scene, several frames; restricted groups inherit the setting."""
    mesh = {"kind": "cloth", "rows": 9, "columns": 8, "plane": "xz", "wave": 0.1}
    effects = [{"effect": name, "weight": 1e3} for name in ("bending", "spring", "strain")]
    scene = make_scene(GRAVITY, {"effect": "pins", "select": "left"}, *effects, mesh=mesh)
    for group in scene.groups:
        monkeypatch.setattr(type(group), "split_from", 2)
    one, two = (Scene.build(scene.config, scene.mesh, threads) for threads in (1, 2))
    assert [g.threads for g in two.groups] == [2, 2, 2]
    assert np.array_equal(trajectory(one), trajectory(two))


def recording(calls: list):
    """A kernel that notes its arguments and thread, and adds 1 to row ``first``."""

    def kernel(first, last, part, rhs):
        calls.append((first, last, part, threading.current_thread()))
        rhs[first] += 1.0
        return float(last - first)

    return kernel


@pytest.mark.parametrize("threads", [1, 2])
def test_parts_cover_all_units_once(threads):
    calls, rhs = [], np.full((6, 3), 5.0)
    parts = Parts(5, True, 6, lambda unit: np.arange(unit, 6))
    for _ in range(3):
        assert parts.accumulate(recording(calls), rhs, threads) == 5.0
    assert sorted({c[:3] for c in calls}) == [(0, 2, 0), (2, 5, 1)]
    expected = np.full((6, 3), 5.0)
    expected[[0, 2]] += 3.0
    assert np.array_equal(rhs, expected)
    assert len({c[3] for c in calls}) == threads


def test_a_small_group_is_one_part():
    calls, rhs = [], np.zeros((6, 3))
    parts = Parts(5, False, 6, lambda unit: np.arange(unit, 6))
    assert parts.accumulate(recording(calls), rhs, 2) == 5.0
    assert [c[:3] for c in calls] == [(0, 5, 0)]
    assert calls[0][3] is threading.main_thread()


def test_a_fault_of_the_second_thread_is_raised():
    def kernel(first, last, part, rhs):
        if part:
            raise FloatingPointError("second part")
        return 0.0

    parts = Parts(4, True, 2, lambda unit: np.arange(2))
    with pytest.raises(FloatingPointError, match="second part"):
        parts.accumulate(kernel, np.zeros((2, 3)), 2)
