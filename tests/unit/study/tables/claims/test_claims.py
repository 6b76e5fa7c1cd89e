"""Verdicts: every branch, every metric by hand, deciding thresholds, and other rules."""

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from builders import frame
from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import validate
from places import ROOT
from study.tables import declared
from study.tables.claims import claims as verdicts
from study.tables.claims.claims import claims, claims_sensitivity, claims_tests
from study.tables.claims.metrics import METRICS
from study.tables.claims.rules import PARTS, ClaimRule, TestRule, load_claims

HOLDS, FAILS, DEPENDS, MACHINE, UNDECIDED, UNTESTED = verdicts.VERDICTS
RERUNS = [
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
    reruns = frame(
        "scene group method position_basis k r frames blowup_frame relative_error_within_horizon "
        "local_ms",
        *RERUNS,
    )
    reruns["speedup"] = 2.0 / reruns.local_ms
    reruns = reruns.assign(motion="train", horizon_frame=9, playback_error=0.5)
    reruns["deformation_error"] = 3.0 * reruns.relative_error_within_horizon
    twice = reruns.assign(relative_error_within_horizon=2.0 * reruns.relative_error_within_horizon)
    factors = {"heldout": reruns, "kick": twice, "stiffness": twice}
    held_out = [rows.assign(motion=motion, speedup=None) for motion, rows in factors.items()]
    return {
        "reduced_reruns": pd.concat([reruns, *held_out], ignore_index=True),
        "breakeven": frame(
            "scene r ratio solve_ratio lift_ratio",
            ("a", 6, 0.5, 0.1, 0.3), ("a", 20, 1.5, 0.2, 1.1), ("b", 6, 0.25, 0.05, 0.15),
        ).assign(group="spring", method="deim", factor=1.0),
        "noise": frame(
            "r rank relative_error", (6, 12, 1e-9), (10, 12, None), (20, 12, None)
        ).assign(scene="a"),
        "local_share": frame(
            "scene implementation local_ms local_share",
            ("a", "compiled", 8.0, 0.75), ("a", "numpy", 80.0, 0.95), ("b", "compiled", 2.0, 0.5),
        ),
        "singular_values": frame(
            "scene component relative above_roundoff",
            ("a", 1, 1.0, True), ("a", 2, 1e-2, True), ("a", 3, 1e-9, False), ("b", 1, 1.0, False),
            ("b", 2, 0.5, False),
        ).assign(group="spring"),
        "repetitions": frame(
            "scene r varied error_median",
            ("a", 20, "training", np.inf), ("b", 20, "training", 3.0), ("a", 6, "training", 0.1),
            ("b", 6, "training", 1.0), ("a", 10, "training", 0.2), ("b", 10, "training", 2.0),
            ("a", 40, "start", 0.0),
        ).assign(group="spring", method="deim"),
        "reconstruction_error": frame(
            "scene r relative_error relative_error_x relative_error_y gain elements_sampled",
            ("a", 6, 0.3, 0.2, 0.4, 2.0, 6), ("a", 10, None, None, None, np.inf, 9),
            ("b", 20, None, None, None, None, None),
        ).assign(group="spring", method="deim", split="train", relative_error_z=None),
    }  # fmt: skip


def rule(metric: str, compare: str = "<=", threshold: float = 1.0, **settings) -> TestRule:
    base = {"what": "rows", "metric": metric, "compare": compare, "threshold": threshold}
    return validate(TestRule, base | settings, "test")


def measured(metric: str, accuracy: float = 0.1, **where) -> list[float]:
    chosen = {k: v if isinstance(v, tuple) else (v,) for k, v in where.items()}
    return METRICS[metric].values(tables(), chosen, accuracy).value.tolist()


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
        # blocks of different lengths, and a single block, have no common trend
        ("trend_p_value", {"scene": "d", "method": "deim"}, []),
        # two blocks of three sizes, both ascending: one of 3!^2 possible orders
        ("repeated_trend_p_value", {"varied": "training"}, [1.0 / 36.0]),
        ("repeated_trend_p_value", {"varied": "training", "scene": "a"}, []),
        # full rank blew up at once: the smaller size must not stand in for it
        ("rerun_error", {"scene": "c", "method": "deim-joint", "r": "full"}, [np.inf]),
        ("rerun_error", {"scene": "c", "method": "qdeim"}, []),
        # a group whose singular values are all rounding errors has no decay
        ("singular_value_decay", {"component": 2}, [1e-2]),
        ("reconstruction_error", {}, [0.3, np.inf]),
        # x and y of two sizes, the second one singular; z is a rounding error at every size
        ("axis_reconstruction_error", {}, [0.2, np.inf, 0.4, np.inf]),
        ("axis_reconstruction_error", {"axis": "y", "scene": "a"}, [0.4, np.inf]),
        # a size beyond the rank does not run, a run that ends early has failed
        ("noise_error", {}, [1e-9, np.inf]),
        ("elements_per_entry", {}, [1.0, 0.9]),
        # a run with a large error has no speed-up; the largest over the sizes of a scene
        ("useful_speedup", {"scene": "a", "method": "deim"}, [0.5, 0.0]),
        ("useful_speedup", {"scene": "a", "accuracy": 0.5}, [0.5, 1.0]),
        ("best_useful_speedup", {"scene": ("a", "b"), "accuracy": 0.5}, [1.0, 2.0]),
        # the largest size of each curve
        ("local_time_ratio", {"group": "spring"}, [1.5, 0.25]),
        ("local_time_ratio", {"scene": "b"}, [0.25]),
        ("solve_time_ratio", {"scene": "a"}, [0.2]),
        ("lift_time_ratio", {}, [1.1, 0.15]),
        ("position_basis_ratio", {"scene": "b"}, [0.1]),
        # neither basis is accurate
        ("position_basis_ratio", {"scene": "b", "accuracy": 0.01}, []),
    ],
)
def test_a_metric_has_the_value_by_hand(metric, where, expected):
    assert measured(metric, **where) == pytest.approx(expected)


def test_the_trend_of_all_experiments_together(monkeypatch):
    """Three blocks of three sizes, all ascending: one of 3!^3 orders, SciPy's smallest p-value."""
    columns = [(s, r, 10, None, float(r)) for s in "efg" for r in (6, 10, 20)]
    rising = [(s, "spring", "deim", "full", None, r, f, b, e, 1.0) for s, r, f, b, e in columns]
    # a short variant of a scene and another method add no block
    more = [(f"{s}_twin", *rest) for s, *rest in rising]
    more += [(*row[:2], "qdeim", *row[3:]) for row in rising]
    # a diverged run is the worst of its block
    failed = [(*row[:8], np.nan if row[5] == 20 else row[8], 1.0) for row in rising]
    falling = [(*row[:8], 1.0 / row[8], 1.0) for row in rising]
    least = 1.0 / 216.0
    for rows, p in ((rising, least), (rising + more, least), (failed, least), (falling, 1.0)):
        monkeypatch.setitem(globals(), "RERUNS", rows)
        assert measured("trend_p_value") == pytest.approx([p])


@pytest.mark.parametrize("metric", ["rerun_error", "error_trend"])
def test_runs_with_reduced_positions_count_only_if_a_rule_names_them(metric, monkeypatch):
    """A method of the same name in a subspace does not change the verdict on unreduced runs."""
    before = measured(metric, method="deim")
    both = [("b", "all", "deim", "pod", 8, r, 10, None, 0.25 * r, 7.0) for r in (50, 100, 200)]
    monkeypatch.setitem(globals(), "RERUNS", RERUNS + both)
    assert before
    assert measured(metric, method="deim") == before
    inside = measured(metric, method="deim", position_basis="pod")
    expected = {"rerun_error": [12.5, 25.0, 50.0], "error_trend": [1.0]}
    assert inside == pytest.approx(expected[metric])


COMPILED = {"where": {"implementation": ["compiled"]}}  # shares 0.75 and 0.5: ratios 3 and 1


@pytest.mark.parametrize(
    ("compare", "threshold", "share", "margin", "expected"),
    [
        (">=", 0.5, 1.0, 1.0, HOLDS),
        (">=", 0.5001, 1.0, 1.0, DEPENDS),
        (">=", 0.7501, 1.0, 1.0, FAILS),
        (">=", 0.6, 0.5, 1.0, HOLDS),
        ("<=", 0.74, 1.0, 1.0, DEPENDS),
        (">=", 0.6, 0.75, 1.49, DEPENDS),  # 0.6: ratio 1.5, from 3 and 1 a factor 2 and 1.5 away
        (">=", 0.6, 0.75, 1.51, MACHINE),
        (">=", 0.4, 0.75, 1.49, HOLDS),  # 0.4: ratio 2/3
        (">=", 0.4, 0.75, 1.51, MACHINE),
        (">=", 0.4, 0.5, 1.51, HOLDS),  # enough clear rows decide
        ("<=", 0.4, 0.75, 1.49, FAILS),
        ("<=", 0.4, 0.75, 1.51, MACHINE),
    ],
)
def test_a_share_of_rows_must_agree_and_ratios_near_the_limit_are_inconclusive(
    compare, threshold, share, margin, expected
):
    test = rule("local_share", compare, threshold, share=share, margin=margin, **COMPILED)
    found = verdicts.outcome(test, tables())
    assert (found["verdict"], found["measured"]) == (expected, "0.5 to 0.75")


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=20), st.data())
def test_a_claim_about_times_is_not_reversed_on_a_machine_twice_as_fast(ratios, data):
    """Ratios that change by less than the margin squared do not cross both of its ends."""
    test = rule("solve_time_ratio", ">=", 1.0)
    moves = data.draw(arrays(float, len(ratios), elements=st.floats(0.45, 2.2)))
    answers = {verdicts.answer_of(test, np.array(ratios) * moved) for moved in (1.0, moves)}
    assert answers != {HOLDS, FAILS}


def test_the_speedup_of_an_inaccurate_run_counts_as_zero():
    test = rule("useful_speedup", "<=", 1.0)
    for third, expected in ((0.0, HOLDS), (1.1, MACHINE)):
        assert verdicts.answer_of(test, np.array([0.0, 0.0, third, 0.9])) == expected


WORDS = dict.fromkeys(
    ("text", "source", "paper", "section", "shown", "qualifiers", "figure_or_table"), "w"
)


def claim(*tests: dict) -> dict:
    base = {
        "what": "rows", "metric": "local_share", "compare": ">=", "threshold": 0.4, "margin": 1.0,
    }  # fmt: skip
    return {
        **WORDS,
        "published": [base | test for test in tests],
        "beyond": [base],
        "changes": [{"date": "2026-01-31", "after_data": False, "reason": "First version."}],
    }


def verdict(tmp_path, *tests: dict) -> pd.Series:
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump({"C1": claim(*tests)}))
    return claims(path, {}, **whole()).iloc[0]


def whole() -> dict[str, pd.DataFrame]:
    """One table for each table that a metric reads."""
    return {m.table: tables().get(m.table, pd.DataFrame()) for m in METRICS.values()}


MIXED = {"threshold": 0.6, **COMPILED}
ABSENT = {"where": {"scene": ["absent"]}}
FALSE = {"threshold": 0.99}


@pytest.mark.parametrize(
    ("tests", "expected"),
    [
        ([{}], HOLDS),
        ([{}, MIXED], DEPENDS),
        ([FALSE, MIXED], FAILS),
        ([ABSENT, MIXED], UNDECIDED),
        ([{}, FALSE], FAILS),
        ([FALSE, ABSENT], UNDECIDED),
        ([{}, FALSE | {"decides": False}], HOLDS),
        ([ABSENT, {"decides": False}], UNDECIDED),
    ],
)
def test_a_claim_gets_the_expected_verdict(tmp_path, tests, expected):
    row = verdict(tmp_path, *tests)
    assert row.verdict == expected
    assert (row.verdict_both, row.verdict_beyond_both) == (expected, HOLDS)  # not of reruns
    assert row.verdict_beyond == HOLDS
    assert row["why"].count("rows:") == len(tests)
    assert row.answer.startswith(f"as published it {expected},")
    assert row.measured.count(";") == sum(t.get("decides", True) for t in tests) - 1


def test_verdicts_by_two_errors_use_the_larger_error(tmp_path):
    """The deformation error is thrice the position error of .1, or missing for rigid references."""
    test = {"metric": "useful_speedup", "where": {"scene": ["a"], "r": [6]}, "accuracy": 0.1}
    for accuracy, both in ((0.4, HOLDS), (0.1, FAILS)):
        row = verdict(tmp_path, test | {"accuracy": accuracy})
        assert (row.verdict, row.verdict_both) == (HOLDS, both)
        rows = claims_sensitivity(tmp_path / "claims.yaml", {}, **whole())
        assert rows.verdict[rows.varied == "measure"].tolist() == [both]
    rigid = {"reduced_reruns": whole()["reduced_reruns"].assign(deformation_error=None)}
    assert claims(tmp_path / "claims.yaml", {}, **whole() | rigid).verdict_both[0] == HOLDS


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"treshold": 1.0}, r"'published\.0\.treshold'"),
        ({"share": 0.4}, r"published\.0\.share"),
        ({"decides": False}, "published"),
        ({"margin": 0.9}, r"published\.0\.margin = 0\.9"),
        ({"metric": "rerun_error", "margin": 2}, "margin = 2"),
        ({"by": "colour"}, "by: .*'colour'"),
        ({"where": {"scene": ["@al"]}}, "'al'"),
        ({"what": 3}, r"published\.0\.what"),
    ],
)
def test_faulty_rules_name_file_claim_and_key(tmp_path, fault, message):
    with pytest.raises(ConfigurationError, match=rf"claims\.yaml: C1: .*{message}"):
        verdict(tmp_path, fault)


def test_a_set_of_scenes_contains_its_values_and_those_that_a_study_adds(tmp_path):
    path = tmp_path / "claims.yaml"
    where = {"scene": ["@ends", "b"], "implementation": ["compiled"]}
    content = {"sets": {"ends": ["a", "z"]}, "C1": claim({"where": where})}
    path.write_text(yaml.safe_dump(content))
    (test,) = load_claims(path)["C1"].published
    assert test.where["scene"] == ("a", "z", "b")
    assert len(METRICS["local_share"].values(tables(), dict(test.where), 0.1)) == 2
    (test,) = load_claims(path, {"ends": ("y",)})["C1"].published
    assert test.where["scene"] == ("a", "z", "y", "b")
    with pytest.raises(ConfigurationError, match=r"claim_sets: no set 'end'.*ends"):
        load_claims(path, {"end": ("z",)})


def test_changes_of_a_claim_must_be_in_order_of_date(tmp_path):
    path, change = tmp_path / "claims.yaml", claim({})["changes"][0]
    later = change | {"date": "2026-02-01", "after_data": True}
    path.write_text(yaml.safe_dump({"C1": claim({}) | {"changes": [later, change]}}))
    with pytest.raises(ConfigurationError, match="changes"):
        load_claims(path)


PATH = ROOT / "config" / "claims.yaml"
RULES = load_claims(PATH)


@pytest.mark.parametrize("name", RULES)
def test_the_last_change_of_a_claim_is_that_of_its_rules(name):
    """An edited rule needs an entry with its date, its reason, and whether results were known."""
    rule = RULES[name]
    assert rule.changes[-1].rules == rule.fingerprint, (
        f"config/claims.yaml: {name}: the rules have the fingerprint {rule.fingerprint}: say when "
        "and why they changed, below 'changes'"
    )


def test_a_fingerprint_changes_with_every_rule_but_not_with_its_words():
    def fingerprint(**changed) -> str:
        return validate(ClaimRule, claim(changed), "test").fingerprint

    same = fingerprint()
    assert fingerprint(what="other words") == same
    others = [
        {"threshold": 0.41}, {"share": 0.6}, {"where": {"scene": ["a"]}}, {"compare": "<="},
        {"margin": 1.2},
    ]  # fmt: skip
    assert len({same, *(fingerprint(**other) for other in others)}) == 1 + len(others)


def test_claims_without_data_are_undecided():
    """Every rule names existing columns, and no rule is satisfied without rows."""
    empty = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    rows = claims(PATH, {}, **empty)
    assert rows.claim.tolist() == list(RULES)
    assert (rows.verdict == UNDECIDED).all()
    untested = rows.claim.isin(["C1", "C8", "C9"])
    assert (rows.verdict_beyond == untested.map({True: UNTESTED, False: UNDECIDED})).all()


def test_test_trajectories_are_judged_by_their_median():
    where = {"position_basis": ["full"]}
    names = ("rerun_error", "heldout_rerun_error")
    own, unseen = (verdicts.values_of(rule(name, where=where), tables()) for name in names)
    pd.testing.assert_frame_equal(unseen.assign(value=0.5 * unseen.value), own, check_dtype=False)


@pytest.mark.parametrize("name", RULES)
def test_a_test_is_timed_if_and_only_if_its_values_change_with_the_times(name):
    for test in (*RULES[name].published, *RULES[name].beyond):
        metric, where = METRICS[test.metric], dict(test.where)
        table = tables()[metric.table]
        absent = {
            column: allowed[0]
            for column, allowed in where.items()
            if column not in table and column not in metric.labels
        }
        table = table.assign(**absent)
        timing = [column for column in declared()[metric.table].timing_columns if column in table]
        slower = table.assign(**{column: 0.5 * table[column] for column in timing})
        one, other = (
            metric.values({**tables(), metric.table: each}, where, test.accuracy).value.to_numpy()
            for each in (table, slower)
        )
        if test.timed and len(one):
            assert not np.array_equal(one, other)
        else:
            np.testing.assert_array_equal(one, other)


def test_only_claims_about_times_are_timed():
    timed = {name: verdicts.timed_columns(rule) for name, rule in RULES.items()}
    one = {"measured", "verdict", "condition", "why"}
    assert timed["C1"] == timed["C9"] == one | {"why_beyond", "answer", "verdict_both"}
    assert timed["C11"] == {f"{name}_beyond" for name in one} | {"answer", "verdict_beyond_both"}
    assert timed["C2"] == timed["C7"] == timed["C12"] == set()
    # a timed test that does not decide makes only the reason timed
    beside = [{"metric": "rerun_error"}, {"decides": False}]
    beside = [{"margin": None} | test for test in beside]
    made = validate(ClaimRule, claim(*beside) | {"beyond": []}, "test")
    assert verdicts.timed_columns(made) == {"why"}


@pytest.mark.parametrize("made", [claims, claims_tests, claims_sensitivity, verdicts.replication])
def test_only_verdicts_that_compare_times_depend_on_the_clock(made):
    names = ["C2", "C9"]
    whats = [RULES[name].published[0].what for name in names]
    rows = pd.DataFrame({"claim": names, "part": "published", "what": whats})
    cells = made.timed_cells(rows, rules=PATH)
    decided = {"verdict", "same"} & {*made.column_names}
    assert [decided <= timed for timed in cells] == [False, True]
    assert not cells[0]


ERRORS = frame(
    "scene r relative_error", ("a", 6, 0.9), ("a", 20, 0.3), ("b", 6, 0.8), ("b", 20, 0.4)
).assign(group="spring", method="deim", split="train", gain=1.0)
SHARES = frame("scene local_share", ("a", 0.75), ("b", 0.5)).assign(implementation="compiled")


def made(path, **rule) -> pd.DataFrame:
    """Variations of a claim with this published test."""
    test = {"metric": "reconstruction_error", "threshold": 0.5, "margin": None}
    path.write_text(yaml.safe_dump({"C1": claim(test | rule)}))
    rows = claims_sensitivity(path, {}, reconstruction_error=ERRORS, local_share=SHARES)
    assert set(rows.part) == set(PARTS)
    return rows[rows.part == "published"]


@pytest.mark.parametrize(
    ("changes", "varied", "expected"),
    [
        ({}, "threshold",
         {"x 0.5": HOLDS, "x 0.8": HOLDS, "x 1.25": DEPENDS, "x 2": FAILS}),
        ({}, "share",
         {"0.5": HOLDS, "0.6": DEPENDS, "0.75": DEPENDS, "0.9": DEPENDS, "1": DEPENDS}),
        ({}, "sizes", {"r up to 10": HOLDS, "r above 10": FAILS}),
        ({}, "scenes", {"without a": DEPENDS, "without b": DEPENDS}),
        ({"where": {"scene": ["a"]}}, "scenes", {}),
        # margins vary where times are compared, splits where a test names more than one
        ({}, "margin", {}),
        ({"metric": "local_share", "threshold": 0.35}, "margin",
         {"1": HOLDS, "1.25": HOLDS, "1.5": HOLDS, **dict.fromkeys(("2", "3", "5"), MACHINE)}),
        ({}, "splits", {}),
        ({"where": {"split": ["train"]}}, "splits", {}),
        ({"where": {"split": ["test", "train"]}}, "splits", {"train": DEPENDS}),
    ],
)  # fmt: skip
def test_a_verdict_is_as_expected_under_other_rules(tmp_path, changes, varied, expected):
    rows = made(tmp_path / "claims.yaml", **changes)
    chosen = rows[rows.varied == varied]
    assert dict(zip(chosen.variation, chosen.verdict, strict=True)) == expected
    unchanged = HOLDS if "metric" in changes else DEPENDS
    assert set(rows.verdict_of_rules) == {unchanged}
    assert (rows.same == (rows.verdict == unchanged)).all()


def test_every_test_of_a_claim_reports_its_values_and_the_deciding_ones_the_verdict():
    tables = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    assert claims_sensitivity(PATH, {}, **tables).empty
    shares = frame("scene local_share", ("a", 0.2), ("b", 0.8), ("c", 0.9))
    tables["local_share"] = shares.assign(implementation="compiled")
    outcomes = claims_tests(PATH, {}, **tables)
    one = outcomes[(outcomes.claim == "C1") & (outcomes.part == "beyond")].iloc[0]
    names = ["satisfied", "of", "close", "verdict", "margin", "least", "median", "most"]
    assert one[names].tolist() == [2, 3, 2, MACHINE, 4.0, 0.2, 0.8, 0.9]
    nothing = outcomes[outcomes.of == 0]
    assert (nothing.verdict == UNDECIDED).all()
    assert nothing[["least", "median", "most"]].isna().all(axis=None)
    # the tests of a part have different words
    assert not outcomes.duplicated(["claim", "part", "what"]).any()
    for row in claims(PATH, {}, **tables).itertuples():
        for part, verdict in (("published", row.verdict), ("beyond", row.verdict_beyond)):
            mine = outcomes[(outcomes.claim == row.claim) & (outcomes.part == part)]
            assert verdicts.combined(list(mine.verdict[mine.decides])) == verdict
