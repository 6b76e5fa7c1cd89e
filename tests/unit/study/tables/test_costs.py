"""Tables of break-even sizes, faster accurate runs, and effects, against counts by hand."""

import numpy as np
import pandas as pd
import pytest

from builders import frame
from pdrom.core.store import write_table
from study.artifact.paths import File
from study.experiments.kit.base import Horizon
from study.tables.accuracy_cost import breakeven, payoff
from study.tables.effects_cost import effects_cost
from study.tables.kit.results import FAILED
from study.tables.kit.results import KEYS as LABELS

HORIZON = Horizon(perturbation=1e-10, threshold=1e-3)
NOT_TIMED = pd.DataFrame(columns=["scene", "ms_per_frame"])  # table frame_times without rows


def curve(folder, scene: str, offset: float, slope: float, full: float) -> File:
    """A local step that costs offset + slope r at five sizes in no order, as a file."""
    r = np.array([5, 10, 20, 40, 100])
    table = pd.DataFrame({"r": r, "local_ms": offset + slope * r}).assign(
        scene=scene, group="spring", method="block-deim", factor=1.0, vertices=9, elements=20,
        full_ms=full, solve_ms=0.5 * offset, lift_ms=slope * r,
    )  # fmt: skip
    write_table(table.sample(frac=1.0, random_state=0), folder / f"{scene}.csv")
    return File(str(folder / f"{scene}.csv"), {})


def test_every_row_has_its_break_even_size(tmp_path):
    lines = {
        "a": (1.0, 0.1, 4.0), "b": (1.0, 0.1, 4.05), "c": (1.0, 0.1, 100.0), "d": (5.0, 0.1, 4.0),
        "e": (1.0, 0.03, 4.0),
    }  # fmt: skip
    table = breakeven([curve(tmp_path, s, *line) for s, line in lines.items()], [])
    offset, slope, full = np.array([lines[scene] for scene in table.scene]).T
    np.testing.assert_allclose(table.ratio, (offset + slope * table.r) / full)
    np.testing.assert_allclose(
        table.solve_ratio + table.lift_ratio, table.ratio - 0.5 * offset / full
    )
    # 1 + 0.1 r = 4; r = 30.5; never; never faster; exactly at the last size
    assert table.breakeven_r.fillna(-1).tolist() == [*np.repeat([30, 31, -1, 5, 100], 5)]


ERROR = "relative_error_within_horizon"
KNOWN = {"reference_error": 0.0, "reference_deformation_error": None}  # the converged run is exact


def tables(runs) -> pd.DataFrame:
    """Reruns of both trajectories; the number of the run is its size r."""
    rows = [
        (scene, "spring", method, "full", None, r, error, speedup, 1.0, held)
        for r, (scene, method, error, speedup, held) in enumerate(runs)
    ]
    both = pd.DataFrame(rows, columns=[*LABELS, ERROR, "speedup", "max_extent", "held"])
    both = both.astype({"speedup": float, "held": float, "k": "Int64"})
    held = both[both.held.notna()].drop(columns=ERROR).rename(columns={"held": ERROR})
    held = held.assign(motion="kick", frames=9, blowup_frame=None, horizon_frame=9, speedup=None,
                       playback_error=0.5)  # fmt: skip
    rows = pd.concat([both.drop(columns="held").assign(motion="train"), held])
    return rows.assign(error_converged=rows[ERROR], deformation_converged=rows[ERROR], **KNOWN)


def paid(reruns, *fewer: tuple, shares: tuple = (), by: str = "position") -> pd.DataFrame:
    """Table `payoff` of one measure, for full-order runs ``fewer`` and groups of ``shares``."""
    points = frame(f"scene method position_basis iterations {ERROR} ms_per_frame", *fewer)
    points = points.assign(deformation_error=points[ERROR], **KNOWN)
    made = payoff(reruns, points, frame("scene effect force_share", *shares))
    return made[made.measure == by].reset_index(drop=True)


def test_errors_are_those_of_the_fastest_accurate_run_or_of_the_most_accurate_run():
    runs = [("a", "deim", 0.01, 2.0, 0.2), ("a", "deim", 0.02, 8.0, 0.3)]
    runs += [("b", "deim", 0.03, 8.0, None), ("b", "deim", 1.0, 9.0, 0.2)]
    runs += [("c", "deim", 0.5, 9.0, 0.9), ("c", "deim", 0.6, 9.9, 0.2)]
    runs += [("d", "deim", FAILED, 4.0, None), ("e", "deim", 0.01, None, None)]  # e: not timed
    runs += [("a", "pod", 0.01, 0.5, None)]
    runs += [("z", "deim", 0.01, 2.0, None)]
    reruns = tables(runs)
    made = paid(reruns.assign(max_extent=reruns.max_extent.where(reruns.scene != "z")))  # not run
    assert made.method.tolist() == ["deim", "pod"]
    row = made.iloc[0]
    assert (row.error_train, row.error_heldout, row.heldout) == (0.065, 0.6, 2)
    assert (row.scenes, row.accurate, row.playback_error) == (4, 3, 0.5)
    assert (row.least_speedup, row.best_speedup, row.most_speedup) == (4.0, 8.0, 8.0)


def test_runs_that_are_faster_are_counted_on_the_test_trajectories():
    """Runs are accurate and fast, accurate and slow, or fast with a test error above 10 %."""
    runs = [("a", "deim", 0.01, 2.0, 0.05), ("b", "deim", 0.02, 0.5, 0.05)]
    reruns = tables([*runs, ("c", "deim", 0.05, 4.0, 0.2)])
    held = reruns[reruns.motion != "train"]
    motions = [held.assign(error_converged=factor * held[ERROR]) for factor in (0.5, 1.5)]
    (row,) = paid(pd.concat([reruns, *motions])).itertuples()
    assert (row.accurate, row.pays, row.loses) == (3, 2, 1)
    assert (row.accurate_heldout, row.pays_heldout, row.heldout) == (2, 1, 3)
    found = (row.error_heldout_low, row.error_heldout, row.error_heldout_high)
    assert found == pytest.approx((0.025, 0.05, 0.075))


def test_a_run_is_accurate_if_both_errors_and_the_error_of_the_reference_are_small():
    """Scene a is accurate in position only, c moves rigidly; errors of b's reference are varied."""
    reruns = tables([(scene, "deim", 0.01, 2.0, 0.01) for scene in "abc"])
    reruns = reruns.assign(deformation_converged=[0.2, 0.05, None] * 2)

    def counts(**own: list) -> list[tuple[int, ...]]:
        rows = (paid(reruns.assign(**own), by=name).iloc[0] for name in ("position", "both"))
        return [(row.scenes, row.accurate, row.heldout, row.accurate_heldout) for row in rows]

    assert counts() == [(3, 3, 3, 3), (3, 2, 3, 2)]
    own = [0.033, 0.034, None, 0.034, 0.0, 0.0]
    assert counts(reference_error=own) == [(1, 1, 0, 0), (1, 0, 0, 0)]
    own = [0.033, 0.05, None] * 2
    assert counts(reference_deformation_error=own) == [(3, 3, 3, 3), (2, 1, 2, 1)]


NO_RUNS = pd.DataFrame(columns=["scene", "perturbation", "frame", "relative_difference"])


def test_effects_are_combined_into_one_time():
    rows = [(scene, *row) for scene in "ab" for row in (("spring", 2.0), ("bending", 6.0))]
    costs = frame("scene effect ms_per_frame", *rows).assign(elements=3, share=0.5)
    times, none = pd.DataFrame({"scene": ["b"], "ms_per_frame": [3.0]}), pd.DataFrame()
    table = effects_cost(costs, none, none, times, NO_RUNS, HORIZON)
    assert table.scene.tolist() == ["a", "a", "b", "b"]
    assert table.elements.tolist() == [3] * 4
    # in scene b the effects add up to its time; a was not timed in several processes
    assert table.ms_per_frame.tolist() == [2.0, 6.0, 0.75, 2.25]
    assert effects_cost(none, none, none, times, NO_RUNS, HORIZON).empty


def test_contributions_cover_the_frames_before_the_horizon_and_have_times():
    """Two frames count; bending contributes less than the sensitivity, and b has only one group."""
    forces = (("a", "spring", 3.0), ("a", "bending", 1.0), ("b", "strain", 4.0))
    rows = [
        (scene, effect, "constraint group", number, force, energy)
        for scene, effect, force in forces
        for number, energy in enumerate([1.0, 5.0, 2.0])
    ]
    rows.append(("b", "kick", "start", 0, 4.0 * np.sqrt(3.0), 7.0))
    acting = frame("scene effect role frame force energy", *rows)
    drifts = {
        ("a", "1e-10"): [1e-6, 1e-5, 1.0], ("a", "without bending"): [1e-7, 1e-7, 9.0],
        ("a", "without spring"): [1e-2, 1e-1, 1.0], ("b", "1e-10"): [1e-6, 1e-6, 1e-6],
        ("b", "without kick"): [0.5, 0.6, 0.7],
    }  # fmt: skip
    drifting = [(*key, number, v) for key, own in drifts.items() for number, v in enumerate(own)]
    sensitivity = frame("scene perturbation frame relative_difference", *drifting)
    costs = frame(
        "scene effect elements ms_per_frame share",
        ("a", "bending", 3, 0.25, 0.5), ("a", "global solve", 9, 0.25, 0.5),
    )  # fmt: skip
    removed = frame(
        "scene left_out groups elements ms_per_frame own_ms",
        ("a", "nothing", 2, 0, 0.5, 0.0), ("a", "bending", 1, 3, 0.3, 0.25),
        ("a", "bending + spring", 0, 6, 0.1, 0.35),
    )  # fmt: skip
    made = effects_cost(costs, removed, acting, NOT_TIMED, sensitivity, HORIZON)
    assert made.effect.tolist() == [
        "bending", "global solve", "nothing", "bending + spring", "spring", "strain", "kick",
    ]  # fmt: skip
    assert made.role.tolist()[1:4] == ["phase", "several", "several"]
    by = made.set_index(["scene", "effect"])
    assert by.loc[("a", "bending + spring"), ["ms_per_frame", "without_ms"]].tolist() == [0.35, 0.1]
    by = by[by.force.notna()]
    assert by.moved[("a", "bending")] == 1e-7
    assert by.moved[("a", "spring")] == 1e-1
    assert by.moved[("b", "kick")] == 0.7
    assert pd.isna(by.moved[("b", "strain")])
    assert by.above_floor.tolist() == [False, True, pd.NA, True]
    assert by.sensitivity_floor[("a", "bending")] == 1e-5
    assert by.force_share.to_numpy() == pytest.approx([0.25, 0.75, 0.5, 0.5])
    assert by.energy.tolist() == [4.0, 4.0, 4.0, 7.0]
    assert by.loc[("a", "bending"), ["ms_per_frame", "without_ms"]].tolist() == [0.25, 0.3]
    assert pd.isna(by.ms_per_frame[("b", "kick")])


def test_full_order_settings_are_compared_first_and_groups_without_force_ignored():
    fewer = [("a", 2, 0.2, 1.0), ("a", 5, 0.05, 2.0), ("b", 2, 0.3, 1.0), ("b", 10, 0.01, 4.0)]
    early = [(scene, "fom", "full", *rest) for scene, *rest in fewer]
    early += [("a", "coarser-mesh", "full", 20, 0.05, 3.0)]
    early += [("a", "coarser-mesh-anderson", "full", 5, 0.08, 1.5)]
    early += [(scene, "full", "full", 10, 0.01, ms) for scene, ms in (("a", 6.0), ("b", 4.0))]
    reruns = tables([("a", "deim", 0.01, 2.0, None), ("b", "deim", 0.01, 2.0, None)])
    shares = [("a", "spring", 1e-3), ("b", "spring", 2e-3)]  # the group of a does not count
    first, second, own = paid(reruns, *early, shares=shares).itertuples()
    assert (first.method, first.scenes, first.accurate) == ("fewer-iterations", 2, 1)
    assert (first.pays, first.best_speedup, first.heldout) == (1, 3.0, 0)
    assert (second.method, second.scenes, second.best_speedup) == ("coarser-mesh", 1, 4.0)
    assert own.scenes == 1
