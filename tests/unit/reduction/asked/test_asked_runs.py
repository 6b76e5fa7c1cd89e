"""Asked errors: what is promised is kept, what cannot be kept is said, and repairs come in time."""

from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest

from builders import make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.asked import measured
from pdrom.reduction.asked import run as checked
from pdrom.reduction.asked.ask import Ask, read_ask, relative_error
from pdrom.reduction.asked.hierarchy import AskSettings, Hierarchy, check_frames, hierarchy
from pdrom.reduction.asked.level import REDUCED_IN_PYTHON, Level
from pdrom.reduction.asked.loops import Remembered
from pdrom.reduction.asked.measured import CONVERGED, Motion, Tried, exact_beside, tried
from pdrom.reduction.asked.run import CheckedRun

EFFECTS = (
    {"effect": "gravity"},
    {"effect": "pins", "select": "left"},
    {"effect": "spring", "weight": 1e5},
)
SHEET = {"kind": "cloth", "rows": 9, "columns": 9, "plane": "xz"}
SETTINGS = AskSettings(modes=(8,), tolerances=(1e-2,), iterations=(10,), factor=1.25)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene(*EFFECTS, mesh=SHEET, frames=30)


@pytest.fixture(scope="module")
def own(scene: Scene) -> Hierarchy:
    return hierarchy(scene, SETTINGS)[0]


def with_reductions_first(own: Hierarchy) -> Hierarchy:
    """The hierarchy as if the full order were dear: on so small a mesh it is cheap."""
    steps = [replace(s, work=1e3 * s.work) if s.level.model is None else s for s in own.steps]
    return replace(own, steps=sorted(steps, key=lambda step: step.work))


def kicked(scene: Scene, speed: float) -> Scene:
    kick = {"effect": "kick", "speed": speed, "seed": 7}
    return make_scene(*EFFECTS, kick, mesh=SHEET, frames=scene.config.frames)


@pytest.mark.parametrize("error", [0.1, 0.03, 0.01])
@pytest.mark.parametrize("reduced", [False, True])
def test_a_promise_is_kept_on_another_motion(scene, own, error, reduced):
    motion = Motion(kicked(scene, 0.4))
    chosen = with_reductions_first(own) if reduced else own
    done = CheckedRun(motion.scene, chosen, Ask(error=error), SETTINGS).outcome()
    assert done.promised
    assert motion.error(done.positions, "position") <= error
    assert done.positions.shape == motion.reference.shape
    assert done.expected <= error


def test_the_cheapest_step_that_keeps_the_ask_is_taken(scene, own):
    for error in (0.2, 0.05):
        steps = own.admissible(Ask(error=error), 1.25)
        assert [s.work for s in steps] == sorted(s.work for s in steps)
        assert all(1.25 * own.expected(s, Ask(error=error)) <= error for s in steps)
        done = CheckedRun(scene, own, Ask(error=error), SETTINGS).outcome()
        assert done.changes[0] == (0, steps[0].level.title)


def test_two_runs_are_the_same_to_the_last_bit(scene, own):
    run = CheckedRun(kicked(scene, 1.0), with_reductions_first(own), Ask(error=0.03), SETTINGS)
    first, again = run.outcome(), run.outcome()
    assert np.array_equal(first.positions, again.positions)
    assert (first.changes, first.work, first.estimate) == (
        again.changes, again.work, again.estimate,
    )  # fmt: skip


def tiny(found: Tried) -> np.ndarray:
    return found.defects * 1e-6


def forgetful(own: Hierarchy) -> Hierarchy:
    """The hierarchy with reductions that were never seen to miss anything: every check alarms."""
    return replace(
        own,
        steps=[
            s
            if s.level.model is None
            else replace(s, tried=[replace(t, probe=partial(tiny, t)) for t in s.tried])
            for s in own.steps
        ],
    )


def test_a_run_that_leaves_what_was_tried_ends_in_full_order(scene, own):
    chosen = forgetful(with_reductions_first(own))
    run = CheckedRun(scene, chosen, Ask(error=0.05), SETTINGS)
    done = run.outcome()
    assert done.repairs >= 1
    assert done.promised
    # the cheapest that keeps to the ask, not the first of half the error
    assert done.changes[-1][1] == run.full_order.title
    assert Motion(scene).error(done.positions, "position") <= 0.05


def test_a_run_on_loops_that_remember_is_the_same(scene, own):
    chosen, ask, loops = forgetful(with_reductions_first(own)), Ask(error=0.05), Remembered(scene)
    alone = CheckedRun(scene, chosen, ask, SETTINGS).outcome()
    for _ in range(2):
        done = CheckedRun(scene, chosen, ask, SETTINGS, loops).outcome()
        assert np.array_equal(done.positions, alone.positions)
        assert (done.changes, done.estimate, done.work) == (
            alone.changes, alone.estimate, alone.work,
        )  # fmt: skip


def test_an_early_repair_starts_anew_and_a_late_one_keeps_what_was_checked(scene, own, monkeypatch):
    chosen = forgetful(with_reductions_first(own))
    monkeypatch.setattr(checked, "EARLY", 1.0)
    anew = CheckedRun(scene, chosen, Ask(error=0.05), SETTINGS).outcome()
    assert [frame for frame, _ in anew.changes] == [0]
    exact = Level(CONVERGED.iterations, CONVERGED.window).scene(scene)
    assert relative_error(anew.positions, trajectory(exact), "position") <= 0.05
    monkeypatch.setattr(checked, "EARLY", 0.0)
    sizes = iter([0.0, 1.0, *[0.0] * 99])
    monkeypatch.setattr(checked, "defect", lambda *a: next(sizes))
    late = CheckedRun(scene, with_reductions_first(own), Ask(error=0.05), SETTINGS).outcome()
    (begin, _), (frame, title) = late.changes
    assert begin == 0 < frame == late.checks[0] + 1
    assert title.startswith("full order")
    assert late.reduced == frame


def test_nothing_is_promised_where_the_full_order_fails_too(scene, own):
    wrong = replace(
        own,
        steps=[
            replace(
                s,
                tried=[replace(t, errors={"position": 1.0, "velocity": 1.0}) for t in s.tried],
            )
            for s in own.steps
        ],
    )
    done = CheckedRun(scene, wrong, Ask(error=0.5), SETTINGS).outcome()
    assert not done.promised
    assert done.reduced == 0
    assert np.isfinite(done.positions).all()


def test_nothing_is_promised_where_next_to_nothing_can_be_judged(scene, own):
    short = replace(own, horizon=scene.config.frames // 10 - 1)
    refused = CheckedRun(scene, short, Ask(error=0.5), SETTINGS).outcome()
    assert not refused.promised
    # as well as possible: with the iterations of the reference
    assert refused.changes == [(0, "full order, Anderson, K = 80")]
    long = replace(own, horizon=scene.config.frames // 10)
    assert CheckedRun(scene, long, Ask(error=0.5), SETTINGS).outcome().promised


@pytest.mark.parametrize(
    ("horizon", "end", "iterations"), [(1e-11, 0, 80), (3e-10, 30, 160), (5e-3, 30, 80)]
)
def test_a_motion_counts_until_half_the_iterations_lead_elsewhere(
    scene, monkeypatch, horizon, end, iterations
):
    monkeypatch.setattr(measured, "HORIZON", horizon)
    motion = Motion(scene)
    assert (motion.end, motion.iterations) == (end, iterations)
    assert len(motion.reference) == scene.config.frames + 1
    exact = trajectory(Level(iterations, CONVERGED.window).scene(scene))
    assert np.abs(motion.reference - exact).max() < 1e-8


class Leaving:
    """Runs that leave each other after ``leaves`` frames, and are ``beside`` each other before."""

    begun: ClassVar[list[tuple[int, bool]]] = []
    leaves = staticmethod(lambda iterations: iterations // 20)
    beside = 0.0

    def __init__(self, scene: Scene, iterations: int, moved: np.ndarray | None = None) -> None:
        self.begun.append((iterations, moved is not None))
        frames = np.arange(scene.config.frames + 1)[:, None, None]
        self._path = frames * (1.0 + iterations * (frames > self.leaves(iterations)))
        self._path += self.beside * (iterations < CONVERGED.iterations) * (frames > 0)

    def after(self, frame: int) -> np.ndarray:
        return self._path[frame + 1]

    def whole(self) -> np.ndarray:
        return self._path


def test_a_run_and_its_reference_never_begin_at_the_same_place(scene, monkeypatch):
    monkeypatch.setattr(measured, "_Accelerated", Leaving)
    motion = Motion(scene)
    assert (motion.end, motion.iterations) == (8, 320)
    assert Leaving.begun == [(80, False), (40, True), (160, True), (320, False), (160, False)]


def test_twice_the_iterations_that_leave_earlier_shorten_what_counts(scene, monkeypatch):
    class Earlier(Leaving):
        leaves = staticmethod({40: 6, 80: 30, 160: 3}.get)

    monkeypatch.setattr(measured, "_Accelerated", Earlier)
    motion = Motion(scene)
    assert (motion.end, motion.iterations) == (3, 80)


@pytest.mark.parametrize(("beside", "end"), [(0.004, 0), (0.001, 10)])
def test_what_counts_is_close_over_all_frames_that_count(scene, monkeypatch, beside, end):
    """The reference moves by 1 a frame, 17.75 in the root mean square of 30 frames, 6.2 of ten."""

    class Beside(Leaving):
        leaves = staticmethod({40: 10, 80: 30}.get)

    monkeypatch.setattr(measured, "MOST", CONVERGED.iterations)
    Beside.beside = beside * np.sqrt(np.mean(np.arange(1, 31) ** 2))
    monkeypatch.setattr(measured, "_Accelerated", Beside)
    assert Motion(scene).end == end


def test_defects_are_taken_where_they_are_wanted(scene, monkeypatch):
    motion, wanted = Motion(scene), []
    monkeypatch.setattr(measured, "defect", lambda *a: wanted.append(a) or 1.0)
    found = tried(Level(3), motion)
    assert not wanted
    assert found.defects == pytest.approx(1.0 / motion.unit)
    assert len(wanted) == len(found.defects) == measured.PROBED


def test_a_full_order_is_not_checked(scene, own, monkeypatch):
    full = replace(own, steps=own.full)
    done = CheckedRun(kicked(scene, 0.4), full, Ask(error=0.05), SETTINGS).outcome()
    assert done.promised
    assert (done.checks, done.estimate, done.repairs) == ([], None, 0)
    assert done.work == done.full_work
    monkeypatch.setattr(checked, "BLOWUP_EXTENT", 0.1)
    blown = CheckedRun(scene, full, Ask(error=0.05), SETTINGS).outcome()
    assert not blown.promised
    assert len(blown.positions) == scene.config.frames + 1


def test_a_reduction_has_to_save_a_third_with_two_checks(scene, own):
    ask, frames = Ask(error=0.05), scene.config.frames
    full = next(s for s in own.admissible(ask, 1.25) if s.level.model is None)
    good = next(s for s in own.steps if s.level.model is not None)
    assert 1.25 * own.expected(good, ask) <= ask.error
    check = own.sure(ask)
    assert own.expected(next(s for s in own.full if s.level is check), ask) <= ask.error / 3
    most = 2 / 3 * full.work - 2 * own.check_work(check) / frames
    for work, taken in ((0.99 * most, True), (1.01 * most, False)):
        one = replace(own, steps=[replace(good, work=work), *own.full])
        assert (one.admissible(ask, 1.25)[0].level is good.level) == taken


def test_contacts_make_the_frames_of_a_reduction_dearer(scene, own):
    reduced = next(s.level for s in own.steps if s.level.model is not None)
    full = next(s.level for s in own.steps if s.level.model is None)
    assert reduced.work(scene, 0.5) - reduced.work(scene) == pytest.approx(0.5 * REDUCED_IN_PYTHON)
    assert full.work(scene, 0.5) == full.work(scene)


def test_a_motion_touches_where_a_vertex_that_is_not_held_lies_on_the_floor():
    fall = {"effect": "gravity"}, {"effect": "spring", "weight": 1e-3}
    lowered = {"effect": "translate", "select": "left", "offset": [0.0, -1.0, 0.0], "over": 3}
    # the sheet begins at y = 2; what is held goes below the floor, too
    for held, height, touching in ((), 0.0, 0.0), ((), 2.0, 1.0), ((lowered,), 1.5, 0.0):
        floor = {"effect": "floor", "height": height}
        motion = Motion(make_scene(*fall, *held, floor, mesh=SHEET, frames=3))
        assert motion.touching == touching
    assert motion.reference[-1, :, 1].min() < 1.5


def test_the_defect_of_a_full_order_is_never_taken_by_a_worse_one(own):
    for step in own.steps:
        if step.level.model is None:
            assert exact_beside(step.level).iterations >= 2 * step.level.iterations
    assert exact_beside(Level(160, 5)).iterations == 320


def test_checks_of_other_iterations_run_on_a_loop_of_their_own(scene, own):
    """A check's level may be gone by the next one: its place in memory says nothing."""
    run = CheckedRun(scene, own, Ask(error=0.5), SETTINGS)
    loops = [run._on(Level(count, 5)) for count in (80, 160, 80)]
    assert loops[0] is loops[2]
    assert loops[0] is not loops[1]


def test_a_reduction_that_blows_up_is_replaced(scene, own):
    """Samples whose factors are wrong by far: the first check finds it."""
    own = with_reductions_first(own)
    step = next(s for s in own.steps if s.level.model is not None)
    ((name, samples),) = step.level.model.samples.items()
    broken = replace(samples, factors=samples.factors * 1e-6)
    model = replace(step.level.model, samples={name: broken})
    bad = replace(
        own,
        steps=[
            replace(step, level=replace(step.level, model=model)),
            *own.full,
        ],
    )
    done = CheckedRun(scene, bad, Ask(error=0.05), SETTINGS).outcome()
    assert done.repairs >= 1
    assert Motion(scene).error(done.positions, "position") <= 0.05


@pytest.mark.parametrize("wish", ["0", "1", "-0.1", "nan", "inf", "", "a", True, "velocity=2"])
def test_a_wish_that_is_no_error_is_refused(wish):
    with pytest.raises(ConfigurationError, match="a number above 0 and below 1"):
        read_ask(wish)


def test_a_wish_may_name_its_quantity():
    assert read_ask("velocity=0.05") == Ask(error=0.05, quantity="velocity")
    assert read_ask(0.1) == read_ask("0.1") == Ask(error=0.1)
    with pytest.raises(ConfigurationError, match="unknown quantity 'speed'"):
        read_ask("speed=0.1")


def test_errors_are_relative_to_the_motion():
    rng = np.random.default_rng(0)
    reference = np.cumsum(rng.standard_normal((5, 4, 3)), axis=0)
    run = reference + 0.01 * (reference - reference[0])
    for quantity in ("position", "velocity"):
        assert relative_error(run, reference, quantity) == pytest.approx(0.01)
    run[-1] = np.nan
    assert relative_error(run, reference, "position") == np.inf
    still = np.zeros((3, 4, 3))
    assert relative_error(still, still, "position") == 0.0
    assert relative_error(still + 1.0, still, "position") == np.inf


@pytest.mark.parametrize("frames", [1, 2, 7, 100])
def test_checks_cost_their_share_and_are_two_at_least(frames):
    for cost, share in ((0.1, 0.05), (1.0, 0.05), (3.0, 0.5)):
        found = check_frames(frames, cost, share)
        assert len(set(found)) == len(found) <= max(2, share * frames / cost)
        assert len(found) >= min(2, frames)
        assert all(0 <= frame < frames for frame in found)
