"""Numbers of the manuscript: found by where they stand, or refused with the reason."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import PaperError
from study.paper.macros import MISSING, format_number, keys_of, macros, number_of

TABLES = {
    "runs": pd.DataFrame(
        {
            "scene": ["bar_a", "bar_a", "b", "b"],
            "method": ["deim", "pod", "deim", "pod"],
            "r": pd.array([6, 6, 20, None], dtype="Int64"),
            "error": [0.123, 4.56e-7, np.nan, np.inf],
            "finite": [True, False, True, True],
        }
    ),
    "study": pd.DataFrame({"scenes": [14], "ranks": ["6, 10"], "threshold": [1e-3]}),
}


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("runs|scene=bar_a|method=deim|error", "0.12"),
        ("runs|scene=bar_a|method=pod|error", r"\ensuremath{4.6\cdot 10^{-7}}"),
        ("runs|scene=b|r=20|error", MISSING),
        ("runs|scene=b|method=pod|error", r"\ensuremath{\infty}"),
        ("runs|scene=b|method=pod|r", MISSING),
        ("runs|scene=b|method=deim|r", "20"),
        ("runs|r=6.0|method=deim|scene", r"bar\_a"),
        ("runs|scene=absent|error", MISSING),
        ("runs|scene=absent|error|max", MISSING),
        ("runs|scene=absent|error|count", MISSING),
        ("runs|scene=bar_a|error|max", "0.12"),
        ("runs|scene=bar_a|error|min", r"\ensuremath{4.6\cdot 10^{-7}}"),
        ("runs|r|median", "6"),
        ("runs|r|count", "3"),
        ("runs|r|distinct", "2"),
        ("runs|r=7|method|distinct", "0"),
        ("runs|scene!=b|method=deim|error", "0.12"),
        ("runs|scene!=bar_a|r!=20|method", "pod"),
        ("runs|error|count", "3"),
        ("study|scenes", "14"),
        ("study|ranks", "6, 10"),
        ("study|threshold", r"\ensuremath{1.0\cdot 10^{-3}}"),
    ],
)
def test_keys_by_hand(key, expected):
    assert number_of(key, TABLES).text == expected


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("run|error", r"no table 'run' \(allowed: runs, study\)"),
        ("runs|errr", r"no column 'errr' \(allowed: scene, method"),
        ("runs|scen=b|error", r"no column 'scen' \(allowed: scene, method"),
        ("runs|scen!=b|error", r"no column 'scen' \(allowed: scene, method"),
        ("runs", "names no column of table 'runs'"),
        ("runs|scene=b", "names no column of table 'runs'"),
        ("runs|scene=b|max", "names no column of table 'runs'"),
        ("runs|max", "names no column of table 'runs'"),
        ("runs|scene=b|error", "matches 2 rows of table 'runs'"),
    ],
)
def test_faulty_keys_name_themselves(key, message):
    with pytest.raises(PaperError, match=message) as caught:
        number_of(key, TABLES)
    assert rf"\val{{{key}}}" in str(caught.value)


SOURCE = r"a \val{study|scenes} b \val{runs|r|count} \val{study|scenes} \value{x} \val {y}"


def test_keys_in_order_of_first_use():
    assert keys_of(SOURCE) == ["study|scenes", "runs|r|count"]
    assert keys_of("no keys") == []


def test_one_macro_a_key():
    text = macros(SOURCE, TABLES)
    assert text.count(r"\expandafter\def") == 2
    assert r"\expandafter\def\csname val@study|scenes\endcsname{14}" in text
    assert r"\expandafter\def\csname val@runs|r|count\endcsname{3}" in text
    assert text.index(r"\makeatletter") < text.index(r"\def") < text.index(r"\makeatother")
    assert macros(SOURCE, TABLES) == text


def test_a_faulty_key_stops_the_macros():
    with pytest.raises(PaperError, match="no table 'gone'"):
        macros(r"\val{study|scenes} \val{gone|x}", TABLES)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0, "0"), (3.0, "3"), (-2, "-2"), (999999.0, "999999"), (np.int64(7), "7"),
        (1e6, r"\ensuremath{1.0\cdot 10^{6}}"), (12345.6, r"\ensuremath{1.2\cdot 10^{4}}"),
        (1234.5, "1234"), (99.6, "100"), (12.34, "12"), (9.96, "10"), (1.26, "1.3"),
        (0.126, "0.13"), (0.0126, "0.013"), (0.00126, r"\ensuremath{1.3\cdot 10^{-3}}"),
        (-0.5, "-0.50"), (float("nan"), MISSING), (float("inf"), r"\ensuremath{\infty}"),
        (True, "yes"), (False, "no"), ("a_b", r"a\_b"),
    ],
)  # fmt: skip
def test_numbers_as_text(value, expected):
    assert format_number(value) == expected


def test_numpy_booleans_are_words():
    """A bool column gives numpy.bool_, which is no bool."""
    assert number_of("runs|scene=b|r=20|finite", TABLES).text == "yes"
    assert number_of("runs|scene=bar_a|method=pod|finite", TABLES).text == "no"


def test_minus_infinity_keeps_its_sign():
    assert "-" in format_number(float("-inf"))


@given(st.floats(1e-12, 1e12))
def test_text_of_a_number_is_close_to_it(value):
    text = format_number(value)
    for old, new in ((r"\ensuremath{", ""), (r"\cdot 10^{", "e"), ("}", "")):
        text = text.replace(old, new)
    assert float(text) == pytest.approx(value, rel=0.051)
    assert format_number(-value) in (f"-{format_number(value)}",
                                     format_number(value).replace("{", "{-", 1))  # fmt: skip
