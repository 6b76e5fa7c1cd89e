"""Tables of break-even sizes and effects, against brute force and synthetic data."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import write_table
from study.artifact.paths import File
from study.experiments.kit.settings import Horizon
from study.tables.effects_cost import effects_cost
from study.tables.payoff import breakeven

HORIZON = Horizon(perturbation=1e-10, threshold=1e-3)
NOT_TIMED = pd.DataFrame(columns=["scene", "ms_per_frame"])  # table frame_times without rows


# Break-even ---------------------------------------------------------------------------------------


def curve(folder, scene: str, offset: float, slope: float, full: float, sizes, shuffle=0) -> File:
    """A local step that costs offset + slope r, as a file."""
    r = np.array(sizes)
    table = pd.DataFrame({"r": r, "local_ms": offset + slope * r}).assign(
        scene=scene, group="spring", method="block-deim", factor=1.0, vertices=9, elements=20,
        full_ms=full, solve_ms=0.5 * offset, lift_ms=slope * r,
    )  # fmt: skip
    write_table(table.sample(frac=1.0, random_state=shuffle), folder / f"{scene}.csv")
    return File(str(folder / f"{scene}.csv"), {})


@pytest.mark.parametrize(
    ("offset", "slope", "full", "expected"),
    [
        (1.0, 0.1, 4.0, 30),  # 1 + 0.1 r = 4
        (1.0, 0.1, 4.05, 31),  # r = 30.5
        (1.0, 0.1, 100.0, None),
        (5.0, 0.1, 4.0, 5),  # it never pays
        (1.0, 0.03, 4.0, 100),  # exactly at the last size
    ],
)
def test_break_even_of_a_line(tmp_path, offset, slope, full, expected):
    path = curve(tmp_path, "a", offset, slope, full, [5, 10, 20, 40, 100])
    table = breakeven([path], [])
    np.testing.assert_allclose(table.ratio, (offset + slope * table.r) / full)
    np.testing.assert_allclose(
        table.solve_ratio + table.lift_ratio, table.ratio - 0.5 * offset / full
    )
    if expected is None:
        assert table.breakeven_r.isna().all()
    else:
        assert table.breakeven_r.tolist() == [expected] * 5


def test_every_curve_has_its_own_break_even(tmp_path):
    paths = [
        curve(tmp_path, "a", 1.0, 0.1, 4.0, [5, 20, 40]),
        curve(tmp_path, "b", 1.0, 0.1, 2.0, [5, 20, 40]),
    ]
    table = breakeven(paths, [])
    assert table.groupby("scene").breakeven_r.unique().map(list).to_dict() == {"a": [30], "b": [10]}


# Effects ------------------------------------------------------------------------------------------


NO_RUNS = pd.DataFrame(columns=["scene", "perturbation", "frame", "relative_difference"])


def test_effects_are_joined_in_one_time(tmp_path):
    cost = {"scene": "a", "effect": "spring", "elements": 3, "ms_per_frame": 1.0, "share": 1.0}
    write_table(pd.DataFrame([cost]), tmp_path / "a.csv")
    write_table(pd.DataFrame([cost | {"scene": "b"}]), tmp_path / "b.csv")
    files = [File(str(tmp_path / f"{name}.csv"), {}) for name in "ab"]
    times = pd.DataFrame({"scene": ["b"], "ms_per_frame": [3.0]})
    table = effects_cost(files, [], [], times, NO_RUNS, HORIZON)
    assert table.scene.tolist() == ["a", "b"]
    # the one time of scene b; a was not timed in several processes
    assert table.ms_per_frame.tolist() == [1.0, 3.0]
    assert effects_cost([], [], [], times, NO_RUNS, HORIZON).empty


def test_contributions_are_judged_before_the_horizon_and_bring_their_times(tmp_path):
    """Two frames count; bending moves less than the floor, the only group of b cannot go."""
    rows = [
        (scene, effect, role, frame, force, energy)
        for scene, effects in (
            ("a", [("spring", "constraint group", 3.0), ("bending", "constraint group", 1.0)]),
            ("b", [("strain", "constraint group", 4.0)]),
        )
        for effect, role, force in effects
        for frame, energy in enumerate([1.0, 5.0, 2.0])
    ]
    rows.append(("b", "kick", "start", 0, 4.0 * np.sqrt(3.0), 7.0))
    header = ["scene", "effect", "role", "frame", "force", "energy"]
    write_table(pd.DataFrame(rows, columns=header), tmp_path / "all.csv")
    drifts = {
        ("a", "1e-10"): [1e-6, 1e-5, 1.0], ("a", "without bending"): [1e-7, 1e-7, 9.0],
        ("a", "without spring"): [1e-2, 1e-1, 1.0], ("b", "1e-10"): [1e-6, 1e-6, 1e-6],
        ("b", "without kick"): [0.5, 0.6, 0.7],
    }  # fmt: skip
    sensitivity = pd.DataFrame(
        [
            (*key, frame, value)
            for key, drift in drifts.items()
            for frame, value in enumerate(drift)
        ],
        columns=["scene", "perturbation", "frame", "relative_difference"],
    )
    costs = pd.DataFrame(
        [("a", "bending", 3, 0.25, 0.5), ("a", "global solve", 9, 0.25, 0.5)],
        columns=["scene", "effect", "elements", "ms_per_frame", "share"],
    )
    removed = pd.DataFrame(
        [
            ("a", "nothing", 2, 0, 0.5, 0.0, 0.0),
            ("a", "bending", 1, 3, 0.3, 0.2, 0.25),
            ("a", "bending + spring", 0, 6, 0.1, 0.4, 0.35),
        ],
        columns=["scene", "left_out", "groups", "elements", "ms_per_frame", "saved_ms", "own_ms"],
    )
    write_table(costs, tmp_path / "costs.csv")
    write_table(removed, tmp_path / "removed.csv")
    files = [[File(str(tmp_path / f"{n}.csv"), {})] for n in ("costs", "removed", "all")]
    made = effects_cost(*files, NOT_TIMED, sensitivity, HORIZON)
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
    assert by.acting_frames.tolist() == [3, 3, 3, 1]
    assert by.loc[("a", "bending"), ["ms_per_frame", "saved_ms"]].tolist() == [0.25, 0.2]
    assert pd.isna(by.ms_per_frame[("b", "kick")])
