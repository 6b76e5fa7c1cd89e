"""Numbers of the manuscript are found by their entries or refused with the reason."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import frame
from pdrom.core.errors import PaperError, PdromError
from study.paper import numbers as tex
from study.paper.numbers import Entry

TABLES = {
    "runs": frame(
        "scene method r error finite",
        ("bar_a", "deim", 6, 0.123, True), ("bar_a", "pod", 6, 4.56e-7, False),
        ("b", "deim", 20, np.nan, True), ("b", "pod", None, np.inf, True),
    ).astype({"r": "Int64"}),
    "study": frame("scenes ranks threshold", (14, "6, 10", 1e-3)),
}  # fmt: skip


def entry(column: str, take: str | None = None, table: str = "runs", **others: object) -> Entry:
    settings = {name: others.pop(name) for name in ("digits", "expect") if name in others}
    return Entry(table=table, rows=others, column=column, take=take, **settings)


def number(asked: Entry) -> tex.Number:
    return tex.number_of("own", {"own": asked}, TABLES)


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        (entry("error", scene="bar_a", method="deim"), "0.12"),
        (entry("error", scene="bar_a", method="deim", digits=3), "0.123"),
        (entry("error", scene="bar_a", method="deim", digits=1), "0.1"),
        (entry("error", scene="bar_a", method="pod"), r"\ensuremath{4.6\cdot 10^{-7}}"),
        (entry("error", scene="b", r=20), tex.MISSING),
        (entry("error", scene="b", method="pod"), r"\ensuremath{\infty}"),
        (entry("scene", r=6.0, method="deim"), r"bar\_a"),
        (entry("error", scene="absent"), tex.MISSING),
        (entry("error", "count", scene="absent"), tex.MISSING),
        (entry("error", "min", scene="bar_a"), r"\ensuremath{4.6\cdot 10^{-7}}"),
        (entry("r", "median"), "6"),
        (entry("r", "distinct"), "2"),
        (entry("method", "distinct", r=7), "0"),
        (entry("error", scene="!=b", method="deim"), "0.12"),
        (entry("method", "count", method=("!=deim", "!=x")), "2"),
        (entry("method", scene="!=bar_a", r="!=20"), "pod"),
        (entry("error", "count"), "3"),
        (entry("finite", scene="b", r=20), "yes"),  # numpy.bool_, which is not a bool
        (entry("finite", scene="bar_a", method="pod"), "no"),
        (entry("method", finite=False), "pod"),
        (entry("ranks", table="study"), "6, 10"),
    ],
)
def test_a_number_of_the_manuscript_is_the_value_by_hand(asked, expected):
    assert number(asked).text == expected


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (entry("error", table="run"), r"own: no table 'run'.*runs"),
        (entry("errr"), r"own: table 'runs' has no column 'errr'.*error"),
        (entry("error", scen="b"), r"own: table 'runs' has no column 'scen'.*scene"),
        (entry("error", scene="b"), "own.* 2 rows of 'runs' match; add"),
    ],
)
def test_a_faulty_entry_of_a_number_is_named(asked, message):
    with pytest.raises(PaperError, match=message):
        number(asked)


def test_an_unknown_number_is_refused():
    with pytest.raises(PaperError, match=r"\\n\{bars\}: no entry.*'bar'"):
        tex.number_of("bars", {"bar": entry("error")}, TABLES)


def test_a_file_of_entries_is_read_and_its_faults_are_named(tmp_path: Path):
    path = tmp_path / "numbers.yaml"
    path.write_text("bar: {table: runs, rows: {r: 6, method: [deim]}, column: error, take: max}")
    assert tex.entries(tmp_path)["bar"].key == "runs|r=6|method=deim|error|max"
    assert tex.entries(tmp_path / "own") == tex.entries(tmp_path)
    path.write_text("bar: {table: runs, column: error, expect: about 5}")
    with pytest.raises(PdromError, match=r"numbers.yaml: bar: expect = 'about 5'"):
        tex.entries(tmp_path)


@pytest.mark.parametrize(
    ("expect", "met"), [(">= 0.123", True), ("> 0.123", False), ("< 1", True), ("<= 0.1", False)]
)
def test_numbers_that_the_text_does_not_expect_are_listed(expect, met):
    asked = {"own": entry("error", scene="bar_a", method="deim", expect=expect)}
    assert (tex.unexpected(asked, TABLES) == {}) is met
    missing = {"own": entry("error", scene="absent", expect=">= 1")}  # only a part of the study
    assert tex.unexpected(missing, TABLES) == {}


def test_names_of_numbers_are_in_order_of_first_use():
    assert tex.names_of(r"a \n{b} \nu{x} \n{a} \norm{y} \n{b} \n {z}") == ["b", "a"]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0, "0"), (3.0, "3"), (-2, "-2"), (999999.0, "999999"), (np.int64(7), "7"),
        (1e6, r"\ensuremath{1.0\cdot 10^{6}}"), (12345.6, r"\ensuremath{1.2\cdot 10^{4}}"),
        (1234.5, "1234"), (99.6, "100"), (12.34, "12"), (9.96, "10"), (1.26, "1.3"),
        (0.126, "0.13"), (0.0126, "0.013"), (0.00126, r"\ensuremath{1.3\cdot 10^{-3}}"),
        (-0.5, "-0.50"), (float("nan"), tex.MISSING), (float("inf"), r"\ensuremath{\infty}"),
        (float("-inf"), r"\ensuremath{-\infty}"), (True, "yes"), (False, "no"), ("a_b", r"a\_b"),
    ],
)  # fmt: skip
def test_a_number_is_formatted_as_tex(value, expected):
    assert tex.format_number(value) == expected


@given(st.floats(1e-12, 1e12))
def test_the_printed_number_is_close_to_its_value(value):
    text = shown = tex.format_number(value)
    for old, new in ((r"\ensuremath{", ""), (r"\cdot 10^{", "e"), ("}", "")):
        text = text.replace(old, new)
    assert float(text) == pytest.approx(value, rel=0.051)
    assert tex.format_number(-value) in (f"-{shown}", shown.replace("{", "{-", 1))


HELD = {"runs": frame("scene method outcome error end", ("bar", "pod", "wrong", 0.5, None))}


@pytest.mark.parametrize(
    ("asked", "held"),
    [
        (entry("error", scene="bar"), True),
        (entry("end", scene="bar"), True),  # an empty cell of a run counts: no value was found
        (entry("error", scene="cloth"), False),
        (entry("error", "max", scene="cloth"), False),
        (entry("error", "count", scene="bar", outcome="accurate"), True),  # zero is a number, too
        (entry("error", "count", scene="cloth", outcome="accurate"), False),
    ],
)
def test_a_number_needs_the_scenes_and_methods_of_its_entry(asked, held):
    assert tex.is_held("own", {"own": asked}, HELD) is held
