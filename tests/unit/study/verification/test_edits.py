"""Edits of tables, with new checksums, that a sceptic tries: each is noticed."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import atomic_path, read_table, write_table
from study.artifact.paths import TABLE
from study.verification.lines import Outcome

RESULTS = "results/studies/tiny"
RERUNS = "reduced_reruns"
ERRORS = ["relative_error", "relative_error_within_horizon", "error_over_extent", "shape_error"]
EDITS = {}


def edit(table, noticed_in=None):
    """An edit of a table by the function below, and in which line it is to be noticed."""

    def declare(function):
        EDITS[function.__name__] = table, function, noticed_in or f"table {table}"
        return function

    return declare


def of_runs(frame, failed):
    """Rows of runs that ended, and failed or did not."""
    error = frame.relative_error_within_horizon
    return frame.index[error > 0.1] if failed else frame.index[error <= 0.1]


@edit(RERUNS)
def errors_of_good_runs_become_one_half(frame):
    frame.loc[of_runs(frame, False), "relative_error"] = 0.5


@edit("reconstruction_error")
def errors_times_thirty_with_other_gains(frame):
    rows = frame.index[frame.gain.notna()][:: 5 * len(frame) // frame.gain.notna().sum()]
    frame.loc[rows, "gain"] *= 1 + 1e-5
    frame.loc[rows, [name for name in frame if "error" in name]] *= 30


@edit("reconstruction_error")
def errors_twice_as_large_with_other_gains(frame):
    rows = frame.index[frame.gain < 100][::10]
    frame.loc[rows, "gain"] *= 1.3
    frame.loc[rows, [name for name in frame if "error" in name]] *= 2


@edit(RERUNS)
def failed_runs_are_left_out(frame):
    return frame.drop(index=of_runs(frame, True))


@edit(RERUNS)
def a_failed_run_is_left_out(frame):
    return frame.drop(index=of_runs(frame, True)[0])


@edit(RERUNS)
def a_failed_run_is_invented(frame):
    return pd.concat([frame, frame.loc[of_runs(frame, True)[:1]].assign(r=999)])


@edit(RERUNS)
def errors_of_failed_runs_become_enormous(frame):
    frame.loc[of_runs(frame, True), ERRORS] = 1e30


@edit(RERUNS)
def failed_runs_become_blow_ups(frame):
    rows = of_runs(frame, True)
    frame.loc[rows, ["frames", "blowup_frame"]] = 3
    frame.loc[rows, ERRORS] = np.nan
    frame.loc[rows, "finite"] = False


@edit(RERUNS)
def a_run_does_not_end(frame):
    frame.loc[of_runs(frame, False)[0], "finite"] = False


@edit(RERUNS)
def a_run_ends_earlier(frame):
    frame.loc[of_runs(frame, False)[0], "frames"] -= 1


@edit("noise")
def blow_ups_on_bases_of_round_off_become_runs(frame):
    rows = frame.index[frame.finite == False]  # noqa: E712 : or empty
    assert len(rows)
    frame.loc[rows, ["finite", "relative_error"]] = [True, 0.01]


@edit("noise")
def runs_on_bases_of_round_off_become_wrong(frame):
    frame.loc[frame.relative_error.notna(), "relative_error"] = 0.5


@edit("stability")
def an_outcome_has_another_name(frame):
    frame.loc[frame.index[frame.outcome == "wrong"][0], "outcome"] = "accurate"


@edit("hard_cases")
def hard_cases_blow_up(frame):
    frame.loc[frame.index[::5], "outcome"] = "blow-up"


@edit("singular_values")
def a_value_moves_a_little(frame):
    frame.loc[frame.singular_value.idxmax(), "singular_value"] *= 1 + 3e-4


@edit("singular_values")
def a_unit_is_another_one(frame):
    frame["singular_value"] *= 1000


@edit("reconstruction_error")
def an_error_moves(frame):
    frame.loc[frame.index[frame.gain < 10][0], "relative_error"] *= 1.1


@edit(RERUNS)
def all_errors_of_held_out_motions_move_a_little(frame):
    frame.loc[frame.motion != "train", "shape_error"] *= 1 + 1e-3


@edit("gain_interventions")
def a_share_is_another_one(frame):
    frame.loc[0, "fallen_share"] = 1 - frame.fallen_share[0]


@edit("gain_interventions")
def runs_are_counted_twice(frame):
    frame["pairs"] *= 2


@edit("reconstruction_error")
def an_element_more_is_sampled(frame):
    frame.loc[frame.index[frame.elements_sampled > 3][0], "elements_sampled"] += 1


@edit("stability")
def a_time_step_is_another_one(frame):
    frame.loc[0, "h"] *= 2


@edit("singular_values")
def a_number_is_missing(frame):
    frame.loc[0, "singular_value"] = np.nan


@edit("singular_values")
def a_number_is_infinite(frame):
    frame.loc[0, "singular_value"] = np.inf


@edit("singular_values")
def a_number_is_a_word(frame):
    frame["singular_value"] = frame.singular_value.astype(object)
    frame.loc[0, "singular_value"] = "large"


@edit("ladder")
def a_row_is_there_twice(frame):
    return pd.concat([frame, frame.head(1)])


@edit("ladder")
def rows_have_another_order(frame):
    return frame.iloc[::-1]


@edit("ladder")
def a_column_is_left_out(frame):
    return frame.drop(columns="gain")


@edit("ladder")
def a_column_has_another_name(frame):
    return frame.rename(columns={"gain": "gains"})


@edit("ladder")
def a_column_is_new(frame):
    return frame.assign(better=True)


@edit("ladder")
def nothing_is_left(frame):
    return frame.head(0)


@edit("reconstruction_error")
def splits_are_swapped(frame):
    frame["split"] = frame.split.map({"train": "heldout", "heldout": "train"})


@edit(RERUNS)
def methods_are_swapped(frame):
    other = {"published": "block-deim", "block-deim": "published"}
    frame["method"] = frame.method.map(lambda name: other.get(name, name))


@edit(RERUNS)
def scenes_are_swapped(frame):
    names = list(frame.scene.unique())
    frame["scene"] = frame.scene.map(dict(zip(names, [*names[1:], names[0]], strict=True)))


@edit(RERUNS)
def a_scene_is_left_out(frame):
    return frame[frame.scene != frame.scene[0]]


@edit("claims", "claim C5")
def a_verdict_as_published_is_another_one(frame):
    frame.loc[frame.claim == "C5", "verdict"] = "holds"


@edit("claims", "claim C11")
def a_verdict_beyond_is_another_one(frame):
    row = frame.claim == "C11"
    words = {"holds": "does not hold"}
    frame.loc[row, "verdict_beyond"] = words.get(frame.verdict_beyond[row].item(), "holds")


@edit("local_share", "claim C1")
def a_verdict_stays_where_its_tables_give_another_one(frame):
    frame["local_share"] = np.where(frame.local_share.median() < 0.7, 0.9, 0.1)


@edit("claims_tests")
def the_reason_of_a_verdict_is_another_one(frame):
    frame.loc[0, "satisfied"] += 1


@edit("claims_sensitivity")
def a_verdict_under_other_rules_is_another_one(frame):
    frame.loc[0, "verdict"] = "depends" if frame.verdict[0] != "depends" else "holds"


@edit("payoff")
def a_speed_up_of_a_derived_table_is_larger(frame):
    frame["best_speedup"] *= 2


@edit("local_share", "table claims_tests")
def times_move_away_from_what_was_made_of_them(frame):
    frame["local_share"] *= 0.5


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_is_noticed(name, examination):
    table, change, place = EDITS[name]
    path = TABLE.at(RESULTS, name=table)
    frame = read_table(path)
    changed = change(frame)
    write_table(frame if changed is None else changed, path)
    kind, line = place.split(" ")
    lines = examination.claims() if kind == "claim" else [examination.table(line)]
    [found] = [one for one in lines if one.name == line]
    assert found.outcome is Outcome.DIFFERS, found


def test_untouched_tables_are_not_noticed(examination):
    good = (Outcome.REPRODUCED, Outcome.NOT_COMPARABLE)
    lines = {name: examination.table(name) for name, *_ in dict.fromkeys(EDITS.values())}
    assert [str(line) for line in lines.values() if line.outcome not in good] == []
    assert {line.outcome for line in examination.claims()} == {Outcome.REPRODUCED}


def test_a_table_that_was_cut_is_noticed(examination):
    path = TABLE.at(RESULTS, name="ladder")
    content = Path(path).read_bytes()
    with atomic_path(path) as temporary:
        temporary.write_bytes(content[: len(content) // 2])
    assert examination.table("ladder").outcome is Outcome.DIFFERS


def test_a_lost_table_and_one_that_is_none_are_noticed(examination):
    Path(TABLE.at(RESULTS, name="ladder")).unlink()
    write_table(pd.DataFrame({"x": [1.0]}), TABLE.at(RESULTS, name="more"))
    lines = {str(line.name): line.outcome for line in examination.lines() if line.kind == "table"}
    assert lines["ladder"] is Outcome.MISSING
    assert lines["more"] is Outcome.DIFFERS
