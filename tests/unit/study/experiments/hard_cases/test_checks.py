"""Each check of a hard case fails for a run that violates it, and passes for one that does not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.record import CHECKS, faults, full_order, record

CASE = CASES["inverted_uneven"]


@pytest.fixture(scope="module")
def scene():
    return CASE.scene()


@pytest.fixture(scope="module")
def run(scene):
    return full_order(CASE, scene)


def with_last(array, value):
    changed = array.copy()
    changed[-1] = value
    return changed


def broken(run, check):
    """The run with one change that violates ``check``."""
    drift = run.velocities.copy()
    drift[10:, :, 0] += 1e-6 * np.abs(run.velocities).max()
    squeezed = run.positions[-1] * [1.0, 0.9, 1.0]
    changes = {
        "finite": {"positions": run.positions[:-1], "blowup_frame": 59},
        "bounded": {"positions": with_last(run.positions, 3.0 * run.positions[-1])},
        "objective": {"excess": with_last(run.excess, 1e-12)},
        "energy": {"energy": with_last(run.energy, 1.001 * run.energy[0])},
        "momentum": {"velocities": drift},
        "determinism": {"positions": np.nextafter(run.positions, np.inf)},
        "recovers": {"positions": with_last(run.positions, squeezed)},
        "still": {},
    }
    return replace(run, **changes[check])


@pytest.mark.parametrize("check", CHECKS)
def test_a_check_finds_its_fault(check, scene, run):
    if check != "still":
        assert CHECKS[check](CASE, scene, run) == ""
    assert CHECKS[check](CASE, scene, broken(run, check)) != ""


def test_a_case_that_is_not_refused_is_a_fault():
    assert faults(replace(CASE, holds=("refused",))) == ["was not refused"]


@pytest.mark.parametrize(("error", "rises"), [(0.0, False), (1e-8, True)])
def test_the_allowance_tells_a_wrong_projection_from_rounding(scene, error, rises):
    """At rest the objective is zero; a relative error of 1e-8 of the right-hand side raises it."""
    group = scene.groups[0]

    def accumulate(y, rhs):
        part = np.zeros_like(rhs)
        energy = group.accumulate(y, part)
        rhs += (1.0 + error) * part
        return energy

    wrong = SimpleNamespace(name="wrong", begin_frame=group.begin_frame, accumulate=accumulate)
    found = record(scene, scene.stepper(local_steps=[wrong]), scene.initial_state())
    assert (found.excess.max() > 0.0) == rises
