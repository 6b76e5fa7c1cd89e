"""Verdicts that rest on times: what may change them from run to run, and what may not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from settled_times import CLAIM, DECIDING, ERROR, PART, RULE, deciding_runs, with_runs

from pdrom.pipeline.tables import all_tables
from pdrom.report.claims import evaluate, is_timed, load_claims
from pdrom.verification.judge import judge
from pdrom.verification.settings import RULES
from pdrom.verification.spread import comparisons
from pdrom.verification.times import changed_by_times, rows_of, timed_spreads
from places import ROOT


@pytest.fixture(scope="module")
def reruns(expected):
    """The runs that the verdict rests on."""
    return deciding_runs(expected)


@pytest.fixture(scope="module")
def limit(tolerances):
    """The factor within which a speed-up may move, less one."""
    return tolerances["ratio", rows_of(DECIDING)].every


def faster(expected, reruns, factors):
    """The tables with other speed-ups."""
    speedup = expected["reduced_reruns"].speedup.copy()
    speedup[reruns] *= factors
    return with_runs(expected, speedup=speedup)


def changed(expected, found, tolerances):
    return changed_by_times({CLAIM: RULE}, expected, found, tolerances)


def verdict(tables):
    return tables["claims"].set_index("claim").verdict_beyond[CLAIM]


def slowed(expected, reruns):
    """Tables in which runs are slower: than a full-order one where they were not much faster."""
    speedup = expected["reduced_reruns"].speedup[reruns]
    return faster(expected, reruns, (0.9 / speedup).clip(lower=0.6))


def test_speed_ups_that_move_a_little_say_nothing(expected, reruns, tolerances, settings):
    found = slowed(expected, reruns)
    assert verdict(found) != verdict(expected)
    why = changed(expected, found, tolerances)
    assert why == {(CLAIM, PART): "rests on times (2 of 9 against 6 of 9)"}
    sides = [{"claims": tables["claims"]} for tables in (expected, found)]
    judged = judge(comparisons(all_tables(), *sides, why)["claims"], tolerances, settings.anew)
    assert judged.differences == ()
    assert judged.left_out["rests on times"] == 1
    plain = comparisons(all_tables(), *sides)["claims"]
    (difference,) = judge(plain, tolerances, settings.anew).differences
    assert "verdict_beyond" in str(difference)


@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_no_move_within_the_tolerance_says_anything(data, expected, reruns, limit, tolerances):
    exponents = data.draw(
        st.lists(st.floats(-1, 1), min_size=len(reruns), max_size=len(reruns)), label="moves"
    )
    found = faster(expected, reruns, (1 + limit) ** (0.99 * np.array(exponents)))
    same = verdict(found) == verdict(expected)
    assert set(changed(expected, found, tolerances)) == (set() if same else {(CLAIM, PART)})


def test_a_move_beyond_the_tolerance_is_a_difference(expected, reruns, limit, tolerances):
    speedup = expected["reduced_reruns"].speedup[reruns]
    fastest = speedup == speedup.max()
    moved = 0.9 / speedup
    moved[fastest] = 0.9 / (1 + limit) / speedup[fastest]
    found = faster(expected, reruns, moved)
    assert verdict(found) != verdict(expected)
    assert changed(expected, found, tolerances) == {}


def test_what_errors_change_is_a_difference(expected, reruns, tolerances):
    """Runs that are accurate no longer count as no gain, whatever their times are."""
    error = expected["reduced_reruns"][ERROR].copy()
    error[reruns] = 0.2
    found = with_runs(expected, **{ERROR: error})
    assert verdict(found) != verdict(expected)
    assert changed(expected, found, tolerances) == {}
    mixed = slowed(expected, reruns)
    one = mixed["reduced_reruns"][ERROR].copy()
    one[reruns[0]] = 0.2
    mixed["reduced_reruns"] = mixed["reduced_reruns"].assign(**{ERROR: one})
    assert changed(expected, mixed, tolerances) == {}


def test_a_verdict_that_is_not_that_of_its_tables_is_a_difference(expected, reruns, tolerances):
    claims = slowed(expected, reruns)["claims"]
    assert changed(expected, {**expected, "claims": claims}, tolerances) == {}


def test_an_expected_verdict_that_no_move_leads_to_is_a_difference(expected, reruns, tolerances):
    fast = faster(expected, reruns, 10.0)
    wrong = {**fast, "claims": slowed(expected, reruns)["claims"]}
    assert verdict(fast) != verdict(wrong)
    assert changed(wrong, fast, tolerances) == {}


def test_rows_or_tables_that_only_one_run_has_are_a_difference(expected, reruns, tolerances):
    found = slowed(expected, reruns)
    fewer = {**found, "reduced_reruns": found["reduced_reruns"].drop(index=reruns[0])}
    assert changed(expected, fewer, tolerances) == {}
    none = {name: table for name, table in found.items() if name != "reduced_reruns"}
    assert changed(expected, none, tolerances) == {}


def test_every_verdict_that_rests_on_times_has_a_tolerance_and_its_reference(expected, tolerances):
    rules = load_claims(ROOT / RULES)
    timed = {
        test.metric: test
        for rule in rules.values()
        for test in (*rule.published, *rule.beyond)
        if test.decides and is_timed(test)
    }
    assert {"local_share", "solve_time_ratio", "useful_speedup"} <= set(timed)
    assert all(("ratio", rows_of(test)) in tolerances for test in timed.values())
    # the digits that references have are enough to decide as the run did
    assert all(evaluate(test, expected).verdict != "cannot be decided" for test in timed.values())
    spreads = list(timed_spreads(rules, expected, expected))
    assert {spread.rows for spread in spreads} == {rows_of(test) for test in timed.values()}
    assert all((spread.distances == 0).all() for spread in spreads)
