"""Numbers of the manuscript: found by where they stand, or refused with the reason."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import frame
from pdrom.core.errors import PaperError
from study.paper import macros as tex

TABLES = {
    "runs": frame(
        "scene method r error finite",
        ("bar_a", "deim", 6, 0.123, True), ("bar_a", "pod", 6, 4.56e-7, False),
        ("b", "deim", 20, np.nan, True), ("b", "pod", None, np.inf, True),
    ).astype({"r": "Int64"}),
    "study": frame("scenes ranks threshold", (14, "6, 10", 1e-3)),
}  # fmt: skip


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("runs|scene=bar_a|method=deim|error", "0.12"),
        ("runs|scene=bar_a|method=pod|error", r"\ensuremath{4.6\cdot 10^{-7}}"),
        ("runs|scene=b|r=20|error", tex.MISSING),
        ("runs|scene=b|method=pod|error", r"\ensuremath{\infty}"),
        ("runs|r=6.0|method=deim|scene", r"bar\_a"),
        ("runs|scene=absent|error", tex.MISSING),
        ("runs|scene=absent|error|count", tex.MISSING),
        ("runs|scene=bar_a|error|min", r"\ensuremath{4.6\cdot 10^{-7}}"),
        ("runs|r|median", "6"),
        ("runs|r|distinct", "2"),
        ("runs|r=7|method|distinct", "0"),
        ("runs|scene!=b|method=deim|error", "0.12"),
        ("runs|scene!=bar_a|r!=20|method", "pod"),
        ("runs|error|count", "3"),
        ("runs|scene=b|r=20|finite", "yes"),  # numpy.bool_, which is no bool
        ("runs|scene=bar_a|method=pod|finite", "no"),
        ("study|ranks", "6, 10"),
    ],
)
def test_keys_by_hand(key, expected):
    assert tex.number_of(key, TABLES).text == expected


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
        tex.number_of(key, TABLES)
    assert rf"\val{{{key}}}" in str(caught.value)


def test_one_macro_a_key_in_order_of_first_use():
    source = r"a \val{study|scenes} b \val{runs|r|count} \val{study|scenes} \value{x} \val {y}"
    assert tex.keys_of(source) == ["study|scenes", "runs|r|count"]
    text = tex.macros(source, TABLES)
    assert text.count(r"\expandafter\def") == 2
    assert r"\expandafter\def\csname val@study|scenes\endcsname{14}" in text
    assert r"\expandafter\def\csname val@runs|r|count\endcsname{3}" in text
    assert text.index(r"\makeatletter") < text.index(r"\def") < text.index(r"\makeatother")


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
def test_numbers_as_text(value, expected):
    assert tex.format_number(value) == expected


@given(st.floats(1e-12, 1e12))
def test_text_of_a_number_is_close_to_it(value):
    text = shown = tex.format_number(value)
    for old, new in ((r"\ensuremath{", ""), (r"\cdot 10^{", "e"), ("}", "")):
        text = text.replace(old, new)
    assert float(text) == pytest.approx(value, rel=0.051)
    assert tex.format_number(-value) in (f"-{shown}", shown.replace("{", "{-", 1))


HELD = {"runs": frame("scene method outcome error end", ("bar", "pod", "wrong", 0.5, None))}
BAR, CLOTH = r"\val{runs|scene=bar|error}", r"\val{runs|scene=cloth|error}"
BLOCKS = rf"""\known{{The bar has {BAR} \emph{{so}}.}} Always. \known{{The cloth has {CLOTH}.}}
\known{{And {CLOTH} again.}}

Next. \known{{Both: {BAR}, {CLOTH}.}}

\begin{{tabular}}{{lr}}
\hline
\row{{bar & {BAR} \\}}
\row{{cloth & {CLOTH} \\}}
\hline
\end{{tabular}}
"""


@pytest.mark.parametrize(
    "source", [r"\known{open {x}", r"\known{a \known{b} c}", r"\known{\row{b} c}"]
)
def test_faulty_blocks_are_named(source):
    with pytest.raises(PaperError, match=r"another one|not closed"):
        tex.sentences(source)


def test_a_block_needs_all_of_its_numbers_and_its_figure():
    made = tex.decisions(BLOCKS, HELD)
    assert made == ["shown", "dropped", "dropped", "dropped", "shown", "dropped"]
    picture = r"\known{\pictureof{bars}{Bars.}}"
    assert tex.decisions(picture, HELD, ["bars"]) == ["shown"]
    assert tex.decisions(picture, HELD, ["sheets"]) == ["dropped"]


@pytest.mark.parametrize(
    ("key", "held"),
    [
        ("runs|scene=bar|error", True),
        ("runs|scene=bar|end", True),  # an empty cell of a run is held: it says that none was found
        ("runs|scene=cloth|error", False),
        ("runs|scene=cloth|error|max", False),
        ("runs|scene=bar|outcome=accurate|error|count", True),  # none of the runs: a number
        ("runs|scene=cloth|outcome=accurate|error|count", False),
    ],
)
def test_what_a_configuration_holds(key, held):
    assert tex.is_held(key, HELD) is held


def test_the_text_names_the_configuration_that_it_was_made_from():
    text = tex.provenance({"main": ["dropped"]}, "config/tiny.yaml", "config/default.yaml")
    assert r"\parttrue" in text
    assert r"\newcommand{\configuration}{\texttt{config/tiny.yaml}}" in text
    assert r"\partfalse" in tex.provenance({}, None, "config/default.yaml")
