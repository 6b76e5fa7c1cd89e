"""Estimated frame errors, the notice of a run, checks by a second run, iterations to an error."""

import re

import h5py
import numpy as np
import pytest

from frame_errors import scene_of, share
from pdrom import api
from pdrom.api.runs import check
from pdrom.core.errors import PdromError
from pdrom.model.dynamics.convergence import Until
from pdrom.model.runs import converged_run, remedy, trajectory

BAR, PLAIN_AND_ANDERSON = "deformation_gradient", pytest.mark.parametrize("window", [0, 5])


@PLAIN_AND_ANDERSON
@pytest.mark.parametrize("scene", [(BAR, 1e9), ("spring", 1e3), ("strain", 1e4), (BAR, 1e5)])
def test_error_estimates_are_right_within_a_factor_of_three(scene, window):
    assert share(scene_of(*scene, 10, window)) == 1.0


@PLAIN_AND_ANDERSON
def test_error_estimates_of_every_20th_frame_change_no_bit_and_are_stored(window, tmp_path):
    for estimate in (True, False):
        api.run(scene_of(BAR, 1e5, 10, window), tmp_path / f"{estimate}.h5", estimate=estimate)
    with h5py.File(tmp_path / "True.h5") as one, h5py.File(tmp_path / "False.h5") as other:
        assert {*one} - {*other} == {"frame_error"}
        assert np.flatnonzero(~np.isnan(one["frame_error"])).tolist() == [10, 30, 50]
        assert all(np.array_equal(one[n], other[n]) for n in ("positions", "objective"))


def test_a_stiff_run_names_a_remedy_that_works_and_a_soft_run_names_none(caplog, monkeypatch):
    scene = scene_of(BAR, 1e9, frames=11)
    api.run(scene, estimate=False)
    api.run(scene_of(BAR, 1e5))
    assert not caplog.text
    api.run(scene)
    remedies = r"converged: .* iterations: (\d+) with anderson_window: (\d+) bring it within 1%"
    numbers = re.findall(remedies, *caplog.messages)[0]
    *_, (state, _) = scene.stepper().run(scene.initial_state(), range(10))
    loop = scene.iterated(*map(int, numbers)).stepper(estimate=True)
    loop.step(state, 10)
    assert loop.errors[10] < 0.03
    monkeypatch.setattr("pdrom.model.runs.TRIED", (2, 3))
    assert "3 accelerated iterations do not bring it within 1%" in remedy(scene, state, 10, 0.05)


def test_trials_of_a_remedy_are_announced_reach_the_error_and_are_few_on_large_meshes(
    caplog, monkeypatch
):
    caplog.set_level("INFO")
    scene = scene_of(BAR, 1e7)
    start = scene.initial_state()
    counts = [int(re.findall(r"\d+", remedy(scene, start, 0, e))[0]) for e in (0.5, 1e-3)]
    assert counts[0] < counts[1]
    assert "trying how many iterations frame 0 needs" in caplog.text
    monkeypatch.setattr("pdrom.model.runs.WORK", 25 * scene.mesh.vertices)
    assert "25 evaluations of a minimiser do not converge it" in remedy(scene, start, 0, 1e-3)


@PLAIN_AND_ANDERSON
def test_frames_iterate_until_their_error_is_small_or_the_maximum_is_reached(window, caplog):
    scene = scene_of("spring", 1e2, Until(error=0.01), window)
    assert share(scene) >= 0.9
    still = scene.changed(effects=scene.config.effects_without("gravity"))
    for each, solver in ((scene, "supernodal"), (scene, "splu"), (still, "supernodal")):
        loop, start = each.stepper(each.system_with(solver)), 1e-10 * each.mesh.points
        assert len([*loop.run(each.initial_state(start), range(60))]) == len(loop.errors)
        assert loop.worst[0] <= 0.01
    full = api.run(scene.iterated(Until(error=1e-6, most=13), window))
    assert caplog.text.count("not converged after 13 iterations (most)") == 1
    assert np.array_equal(full.positions, trajectory(scene.iterated(13))) == (window == 0)


def modelled(run):
    return api.train(api.run(run.scene.iterated(9)), modes=4, converged=False).run(run.scene)


@pytest.mark.parametrize("refusing", [api.train, lambda run: api.cost(run.scene), modelled])
def test_iterations_until_an_error_are_refused_where_a_number_is_needed(refusing):
    full = api.run(scene_of(BAR, 1e5, Until(error=0.1), frames=9))
    with pytest.raises(PdromError, match="only full-order runs iterate until an estimated"):
        refusing(full)


@pytest.mark.parametrize("count", [10, Until(error=0.1)])
def test_a_second_run_estimates_the_error_of_a_run(count):
    scene = scene_of("spring", 1e3, 10, frames=20)
    full, best = api.run(scene.iterated(count)), converged_run(scene, 1e-9, 9999)
    exact = api.Run(scene, best, full.ms, method="full order, converged")
    assert 1 / 3 < check(full).position / full.error(exact).position < 3
    with pytest.raises(PdromError, match="a full-order run is required"):
        check(exact)
