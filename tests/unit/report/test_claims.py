"""Verdicts: every branch, every metric by hand, and thresholds that decide."""

import numpy as np
import pandas as pd
import pytest

from conftest import ROOT
from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import validate
from pdrom.report.claims import (
    FAILS,
    HOLDS,
    METRICS,
    UNDECIDED,
    ClaimRule,
    TestRule,
    claims_rows,
    load_claims,
    timed_columns,
)
from pdrom.report.claims import evaluate as evaluated
from pdrom.report.decide import claims
from pdrom.tables import declared

RERUNS = [
    # scene, group, method, position_basis, k, r, frames, blowup, error within, local_ms
    ("a", "spring", "deim", "full", None, 6, 10, None, 0.1, 4.0),
    ("a", "spring", "deim", "full", None, 10, 10, None, 0.4, 2.0),
    ("a", "spring", "deim", "full", None, 20, 0, None, None, None),
    ("b", "spring", "deim", "full", None, 6, 10, None, 0.2, 1.0),
    ("b", "spring", "deim", "full", None, 30, 3, 2, None, 3.0),
    ("b", "spring", "pod", "full", None, 6, 0, 0, None, None),
    ("c", "spring", "deim", "full", None, 6, 0, 0, None, None),
    ("c", "spring", "deim", "full", None, 20, 10, None, 0.3, None),
    ("c", "spring", "deim-joint", "full", None, 6, 10, None, 0.7, None),
    ("c", "spring", "deim-joint", "full", None, 20, 0, 0, None, None),
    ("c", "spring", "qdeim", "full", None, 6, 0, None, None, None),
    ("d", "spring", "deim", "full", None, 6, 10, None, 0.1, None),
    ("d", "spring", "deim", "full", None, 10, 10, None, 0.4, None),
    ("d", "spring", "deim", "full", None, 20, 5, 5, None, None),
    ("d", "spring", "deim", "full", None, 40, 10, None, 0.3, None),
    ("d", "spring", "deim", "full", None, 99, 0, None, None, None),
    ("d", "spring", "qdeim", "full", None, 6, 1, 1, None, None),
    ("d", "spring", "qdeim", "full", None, 10, 2, 2, None, None),
    ("d", "spring", "qdeim", "full", None, 20, 3, 3, None, None),
    ("b", "all", "full", "pod", 8, 99, 10, None, 0.02, 1.0),
    ("b", "all", "full", "skinning", 8, 99, 10, None, 0.2, 1.0),
    ("b", "all", "full", "pod", 16, 99, 10, None, 0.01, 1.0),
]


def tables() -> dict[str, pd.DataFrame]:
    reruns = pd.DataFrame(
        RERUNS,
        columns=[
            "scene", "group", "method", "position_basis", "k", "r", "frames", "blowup_frame",
            "relative_error_within_horizon", "local_ms",
        ],
    )  # fmt: skip
    return {
        "reduced_reruns": reruns,
        "breakeven": pd.DataFrame(
            {
                "scene": ["a", "a", "b"],
                "group": "spring",
                "method": "deim",
                "factor": 1.0,
                "threads": 1,
                "r": [6, 20, 6],
                "ratio": [0.5, 1.5, 0.25],
            }
        ),
        "local_share": pd.DataFrame(
            {
                "scene": ["a", "a", "b"],
                "implementation": ["compiled", "numpy", "compiled"],
                "local_ms": [8.0, 80.0, 2.0],
                "local_share": [0.75, 0.95, 0.5],
            }
        ),
        "singular_values": pd.DataFrame(
            {
                "scene": ["a"] * 3 + ["b"] * 2,
                "group": "spring",
                "component": [1, 2, 3, 1, 2],
                "relative": [1.0, 1e-2, 1e-9, 1.0, 0.5],
                "above_roundoff": [True, True, False, False, False],
            }
        ),
        "reconstruction_error": pd.DataFrame(
            {
                "scene": ["a", "a", "b"],
                "method": ["deim", "deim", "deim"],
                "r": [6, 10, 20],
                "relative_error": [0.3, None, None],
                "gain": [2.0, np.inf, None],
                "elements_sampled": [6, 9, None],
            }
        ),
    }


def rule(metric: str, compare: str = "<=", threshold: float = 1.0, **settings) -> TestRule:
    base = {"what": "rows", "metric": metric, "compare": compare, "threshold": threshold}
    return validate(TestRule, base | settings, "test")


def measured(metric: str, **where) -> list[float]:
    chosen = {k: v if isinstance(v, tuple) else (v,) for k, v in where.items()}
    return METRICS[metric].values(tables(), chosen).tolist()


@pytest.mark.parametrize(
    ("metric", "where", "expected"),
    [
        ("local_share", {"implementation": "compiled"}, [0.75, 0.5]),
        # sizes that were not run do not count, blow-ups are infinite
        ("rerun_error", {"scene": "a"}, [0.1, 0.4]),
        ("rerun_error", {"scene": "b", "group": "spring"}, [0.2, np.inf, np.inf]),
        ("rerun_error", {"scene": ("a", "b"), "method": "deim", "r": "full"}, [0.4, np.inf]),
        ("rerun_error", {"scene": "a", "r": 6}, [0.1]),
        # two sizes have no trend; ranks of (0.1, 0.4, blow-up, 0.3) at r = 6, 10, 20, 40
        ("error_trend", {"scene": "a", "method": "deim"}, []),
        ("error_trend", {"scene": "d", "method": "deim"}, [0.4]),
        ("error_trend", {"scene": "d", "method": "qdeim"}, [0.0]),
        # full rank blew up at once: the smaller size must not stand in for it
        ("rerun_error", {"scene": "c", "method": "deim-joint", "r": "full"}, [np.inf]),
        ("rerun_error", {"scene": "c", "method": "qdeim"}, []),
        # a group whose singular values are all round-off has no decay
        ("singular_value_decay", {"component": 2}, [1e-2]),
        ("reconstruction_error", {}, [0.3, np.inf]),
        ("elements_per_entry", {}, [1.0, 0.9]),
        # the largest size of each curve
        ("local_time_ratio", {"group": "spring"}, [1.5, 0.25]),
        ("local_time_ratio", {"scene": "b"}, [0.25]),
        ("position_basis_ratio", {"scene": "b"}, [0.1]),
    ],
)
def test_metrics_by_hand(metric, where, expected):
    assert measured(metric, **where) == pytest.approx(expected)


@pytest.mark.parametrize("metric", ["rerun_error", "error_trend"])
def test_runs_with_reduced_positions_count_only_if_asked_for(metric, monkeypatch):
    """A method of the same name in a subspace does not change the verdict on unreduced runs."""
    before = measured(metric, method="deim")
    both = [("b", "all", "deim", "pod", 8, r, 10, None, 0.25 * r, 7.0) for r in (50, 100, 200)]
    monkeypatch.setitem(globals(), "RERUNS", RERUNS + both)
    assert before
    assert measured(metric, method="deim") == before
    inside = measured(metric, method="deim", position_basis="pod")
    expected = {"rerun_error": [12.5, 25.0, 50.0], "error_trend": [1.0]}
    assert inside == pytest.approx(expected[metric])


@pytest.mark.parametrize(
    ("compare", "threshold", "share", "passed"),
    [
        (">=", 0.5, 1.0, True),
        (">=", 0.6, 1.0, False),
        (">=", 0.6, 0.5, True),
        (">=", 0.8, 0.5, False),
        ("<=", 0.75, 1.0, True),
        ("<=", 0.74, 1.0, False),
        ("<=", 0.74, 0.5, True),
    ],
)
def test_share_of_rows_that_must_pass(compare, threshold, share, passed):
    test = rule("local_share", compare, threshold, share=share,
                where={"implementation": ["compiled"]})  # fmt: skip
    outcome = evaluated(test, tables())
    assert outcome.passed is passed
    assert outcome.measured == "0.5 to 0.75"


def test_sentence_counts_and_shows_the_spread():
    where = {"method": ["deim"], "scene": ["a", "b"]}
    outcome = evaluated(rule("rerun_error", "<=", 0.3, where=where), tables())
    assert outcome.sentence == "rows: 2 of 4 at most 0.3 (measured 0.1 to blow-up)"
    one = evaluated(rule("position_basis_ratio", "<=", 1.0), tables())
    assert one.sentence == "rows: 1 of 1 at most 1 (measured 0.1)"


@pytest.mark.parametrize(
    ("value", "text"), [(1234.0, "1200"), (123456.0, "1.2e+05"), (99.4, "99"), (0.0123, "0.012")]
)
def test_measured_numbers_have_two_digits(value, text):
    changed = tables()
    changed["local_share"] = changed["local_share"].assign(local_share=value)
    assert evaluated(rule("local_share"), changed).measured == text


def claim(*tests: dict) -> dict:
    base = {"what": "rows", "metric": "local_share", "compare": ">=", "threshold": 0.4}
    return {
        "text": "t", "source": "s", "paper": "p", "figure_or_table": "f",
        "tests": [base | test for test in tests],
    }  # fmt: skip


def verdict(tmp_path, *tests: dict) -> pd.Series:
    import yaml

    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump({"C1": claim(*tests)}))
    return claims(path, **tables()).iloc[0]


ABSENT = {"where": {"scene": ["absent"]}}
FALSE = {"threshold": 0.99}


@pytest.mark.parametrize(
    ("tests", "expected"),
    [
        ([{}], HOLDS),
        ([FALSE], FAILS),
        ([ABSENT], UNDECIDED),
        ([{}, {}], HOLDS),
        ([{}, FALSE], FAILS),
        ([FALSE, FALSE], FAILS),
        ([{}, ABSENT], UNDECIDED),
        ([FALSE, ABSENT], UNDECIDED),
        ([{}, FALSE | {"decides": False}], HOLDS),
        ([{}, ABSENT | {"decides": False}], HOLDS),
        ([FALSE, {"decides": False}], FAILS),
        ([ABSENT, {"decides": False}], UNDECIDED),
    ],
)
def test_every_verdict(tmp_path, tests, expected):
    row = verdict(tmp_path, *tests)
    assert row.verdict == expected
    assert row["why"].count("rows:") == len(tests)
    assert row.measured.count(";") == sum(t.get("decides", True) for t in tests) - 1


def test_missing_data_are_said_to_be_missing(tmp_path):
    row = verdict(tmp_path, ABSENT)
    assert row.verdict == "cannot be decided"
    assert row.measured == "no data"
    assert row["why"] == "rows: nothing to compare in this configuration."


def test_a_group_of_rank_zero_is_no_missing_scene():
    """The run is in the configuration; it is the data that hold nothing to reduce."""
    where = {"scene": ["c"], "method": ["qdeim"]}
    outcome = evaluated(rule("rerun_error", where=where), tables())
    assert outcome.passed is None
    assert outcome.sentence == "rows: no size can run, the numerical rank allows none"
    where = {"scene": ["absent"], "method": ["qdeim"]}
    outcome = evaluated(rule("rerun_error", where=where), tables())
    assert outcome.sentence == "rows: nothing to compare in this configuration"


def test_a_threshold_flips_the_verdict(tmp_path):
    where = {"where": {"implementation": ["compiled"]}}
    assert verdict(tmp_path, where | {"threshold": 0.5}).verdict == HOLDS
    assert verdict(tmp_path, where | {"threshold": 0.5001}).verdict == FAILS
    assert verdict(tmp_path, where | {"threshold": 0.5001, "compare": "<="}).verdict == FAILS


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"metric": "beauty"}, "metric = 'beauty': allowed are local_share, rerun_error"),
        ({"treshold": 1.0}, r"unknown key 'tests\.0\.treshold' \(allowed: what, metric"),
        ({"compare": "=="}, r"tests\.0\.compare = '=='"),
        ({"share": 0.0}, r"tests\.0\.share"),
        ({"share": 1.1}, r"tests\.0\.share"),
        ({"threshold": float("nan")}, r"tests\.0\.threshold"),
        ({"decides": False}, "none of them decides"),
    ],
)
def test_faulty_rules_name_file_claim_and_key(tmp_path, fault, message):
    with pytest.raises(ConfigurationError, match=rf"claims\.yaml: C1: .*{message}"):
        verdict(tmp_path, fault)


@pytest.mark.parametrize("content", ["", "[]", "C1: 3", "C1: {tests: []}"])
def test_files_that_hold_no_claims_are_refused(tmp_path, content):
    path = tmp_path / "claims.yaml"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=r"claims\.yaml"):
        load_claims(path)


def test_unknown_columns_are_named():
    with pytest.raises(ConfigurationError, match=r"no column 'scen' \(allowed: scene, "):
        evaluated(rule("local_share", where={"scen": ["a"]}), tables())


RULES = load_claims(ROOT / "config" / "claims.yaml")


def test_the_claims_are_those_of_the_paper():
    assert list(RULES) == [f"C{i}" for i in range(1, 13)]


@pytest.mark.parametrize("name", RULES)
def test_without_data_nothing_is_decided(name):
    """Every rule names columns that exist, and none passes for lack of rows."""
    empty = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    row = claims_rows({name: RULES[name]}, empty).iloc[0]
    assert (row.claim, row.verdict) == (name, UNDECIDED)


# Which cells a clock decides ----------------------------------------------------------------------


@pytest.mark.parametrize("name", RULES)
def test_a_metric_reads_no_column_that_it_does_not_name(name):
    """So that a claim counts as timed if and only if it uses times."""
    for test in RULES[name].tests:
        metric = METRICS[test.metric]
        whole = tables()
        absent = {
            c: allowed[0] for c, allowed in test.where.items() if c not in whole[metric.table]
        }
        whole[metric.table] = whole[metric.table].assign(**absent)
        kept = {*metric.columns, *test.where} & set(whole[metric.table].columns)
        part = {**whole, metric.table: whole[metric.table][sorted(kept)]}
        where = dict(test.where)
        np.testing.assert_array_equal(metric.values(part, where), metric.values(whole, where))


def test_only_claims_about_times_are_timed():
    timed = {name: timed_columns(rule) for name, rule in RULES.items()}
    assert timed["C1"] == timed["C9"] == {"measured", "verdict", "why"}
    assert timed["C2"] == timed["C7"] == timed["C12"] == set()


def test_another_verdict_is_seen_where_no_clock_decides():
    made = pd.DataFrame(
        [{"claim": c, "verdict": HOLDS, "why": "a", "measured": "1"} for c in RULES]
    )
    made = made.reindex(columns=claims.column_names, fill_value="")
    kept = claims.without_times(made, ROOT)
    for place, name in enumerate(RULES):
        other = made.copy()
        other.loc[place, "verdict"] = UNDECIDED
        changed = not claims.without_times(other, ROOT).equals(kept)
        assert changed == ("verdict" not in timed_columns(RULES[name])), name


def test_a_test_beside_the_verdict_makes_its_reason_timed():
    own = {"what": "rows", "compare": ">=", "threshold": 0.5}
    decides = TestRule(metric="rerun_error", **own)
    beside = TestRule(metric="local_share", decides=False, **own)
    base = {"text": "t", "source": "s", "paper": "p", "figure_or_table": "f"}
    assert timed_columns(ClaimRule(tests=(decides, beside), **base)) == {"why"}
    assert timed_columns(ClaimRule(tests=(decides,), **base)) == set()
