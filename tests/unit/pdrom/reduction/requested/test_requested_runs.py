"""Runs within a requested tolerance: met or refused, whatever the run differs in."""

import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.model.runs import converged_run
from pdrom.model.scene import Scene
from pdrom.reduction.requested import levels
from pdrom.reduction.requested import run as requested
from pdrom.reduction.requested.levels import Trajectory, last_within, relative_errors

SHEET = {"kind": "cloth", "rows": 7, "columns": 7, "plane": "xz"}
SETTINGS = requested.ToleranceSettings(modes=(8,), tolerances=(1e-2,), iterations=(10,), factor=2.0)
FRAMES, KICK = 24, {"effect": "kick", "speed": 0.4, "seed": 7}


def sheet(*more, weight: float = 1e5, **keys) -> Scene:
    effects = {"effect": "spring", "weight": weight}, *more
    return make_scene(GRAVITY, LEFT, *effects, mesh=SHEET, **{"frames": FRAMES, **keys})


@pytest.fixture(scope="module")
def own() -> requested.Calibration:
    return requested.calibrate(sheet(), SETTINGS)


def error_of(scene: Scene, positions: np.ndarray, frames: int) -> float:
    """Error over the first frames against frames solved to convergence."""
    exact = converged_run(scene, 1e-9, 8000)
    wrong = positions[1 : frames + 1] - exact[1 : frames + 1]
    return float(relative_errors(wrong, exact, "position")[-1])


@pytest.mark.parametrize("error", [0.1, 0.03, 0.01])
def test_a_tolerance_is_met_on_another_motion(own, error):
    scene = sheet(KICK)
    done = requested.CheckedRun(own, scene, error).outcome()
    assert done.met
    assert error_of(scene, done.positions, done.frames) <= error
    assert done.estimate <= error


@pytest.mark.parametrize(
    "changes", [{"weight": 1e8}, {"vertex_mass": 0.1}, {"time_step": 0.048}], ids=str
)
@pytest.mark.parametrize("error", [0.05, 0.01])
def test_what_a_calibration_rests_on_may_differ_when_it_is_made_again(changes, error):
    scene = sheet(**changes)
    calibration = requested.calibrate(requested.transferred(sheet(), scene), SETTINGS)
    done = requested.CheckedRun(calibration, scene, error).outcome()
    assert not done.met or error_of(scene, done.positions, done.frames) <= error


@pytest.mark.parametrize(("group", "rows"), [("spring", 6), ("strain", 7)])
def test_other_cells_or_groups_are_refused(group, rows):
    other = make_scene(
        GRAVITY, LEFT, {"effect": group, "weight": 1e5}, mesh={**SHEET, "rows": rows}
    )
    with pytest.raises(ConfigurationError, match="another mesh or other constraint groups"):
        requested.transferred(sheet(), other)


def test_a_tolerance_below_what_is_known_of_a_motion_is_refused(own, monkeypatch):
    """The most accurate full order runs in its place."""
    assert own.admissible(1e-14) == []
    done = requested.CheckedRun(own, sheet(KICK), 1e-14).outcome()
    assert (done.met, done.reduced, bool(done.limit)) == (False, False, True)
    level = own.most_accurate.level
    assert done.level == level.title == "full order, L-BFGS to 1e-08"
    expected = Trajectory(level, sheet(KICK)).to(FRAMES).positions
    assert np.array_equal(done.positions, expected)
    monkeypatch.setattr(levels, "EXACT", levels.Level(3, residual=1e-12))  # not solved
    assert np.isinf(levels.Motion(sheet(KICK), "position").unknown).all()


def test_a_full_order_is_checked_too_and_replaced_by_a_better_one(own, monkeypatch):
    """With a check that finds every frame of the first level bad."""
    levels = []

    def poor(run: Trajectory, exact: Trajectory) -> float:
        levels.append(run.level.title)
        frame = run.frames
        run.to(frame + 1)
        run.defects[frame] = 1e3 if run.level.title == levels[0] else 0.0
        return run.defects[frame]

    monkeypatch.setattr(Trajectory, "check", poor)
    done = requested.CheckedRun(own, sheet(), 0.05).outcome()
    assert done.failed[0] == levels[0] != done.level


def test_a_run_that_departs_from_its_second_run_is_met_for_fewer_frames(own, monkeypatch):
    late = np.where(np.arange(FRAMES) < 10, 0.0, np.inf)
    monkeypatch.setattr(requested.CheckedRun, "_amplified", lambda *_: late)
    done = requested.CheckedRun(own, sheet(), 0.05).outcome()
    assert (done.frames, done.limit) == (10, requested.AMPLIFIED)


def test_two_runs_are_the_same_to_the_last_bit(own):
    run = requested.CheckedRun(own, sheet(KICK), 0.03)
    first, again = run.outcome(), run.outcome()
    assert np.array_equal(first.positions, again.positions)
    for name in ("level", "checks", "estimate"):
        assert getattr(first, name) == getattr(again, name)


def test_the_cheapest_level_that_meets_it_is_tried_first(own):
    levels = own.admissible(0.1)
    assert [each.work for each in levels] == sorted(each.work for each in levels)
    assert all(own.expected(each, 0.1) <= 0.1 for each in levels)


def test_velocities_are_differences_of_positions():
    reference = np.cumsum(np.ones((4, 2, 3)), axis=0)
    wrong = np.full((3, 2, 3), 0.1)
    assert relative_errors(wrong, reference, "position")[0] == pytest.approx(0.1)
    np.testing.assert_allclose(
        relative_errors(wrong, reference, "velocity"), 0.1 / np.sqrt([1.0, 2.0, 3.0])
    )
    # of a still motion they are zero or infinite
    still = np.zeros((3, 2, 3))
    assert relative_errors(still[1:], still, "position").tolist() == [0.0, 0.0]
    assert relative_errors(still[1:] + 1.0, still, "position").tolist() == [np.inf, np.inf]
    # frames within a tolerance are counted to the last
    assert last_within(np.array([0.1, 0.5, 0.2, 0.6]), 0.3) == 3
    assert last_within(np.array([0.5]), 0.3) == 0


@pytest.mark.parametrize(
    "wish", [0.0, 1.0, 2, -1, "x", "speed=0.1", "velocity=2", True, None, "nan"]
)
def test_a_tolerance_that_is_none_is_named(wish):
    with pytest.raises(ConfigurationError, match="error"):
        requested.read_request(wish)


def test_a_tolerance_may_be_of_the_velocities():
    assert requested.read_request("velocity=0.05") == requested.Request(
        error=0.05, quantity="velocity"
    )
    assert str(requested.read_request(0.01)) == "1 % of the positions"


@pytest.mark.parametrize(("frames", "count"), [(100, 5), (100, 0), (3, 9), (1, 1)])
def test_checks_are_spread_and_two_at_least(frames, count):
    found = requested.check_frames(frames, count)
    assert len(found) == min(max(2, count), frames)
    assert all(0 <= frame < frames for frame in found)
