"""Captions in light mark-up: TeX, plain words, and reStructuredText without a living sign."""

import pytest
from docutils.core import publish_doctree
from docutils.nodes import paragraph
from hypothesis import given
from hypothesis import strategies as st

from study.artifact.markup import filled, number, to_plain, to_rst, to_tex
from study.figures.kit.declaration import declarations

CAPTION = "The gain $\\gamma \\le 10^{-3}$ of `block_deim`: 70 % of r_k & more."


def test_one_caption_three_ways():
    assert to_plain(CAPTION) == "The gain γ ≤ 10⁻³ of block_deim: 70 % of r_k & more."
    assert to_tex(CAPTION) == (
        r"The gain $\gamma \le 10^{-3}$ of \texttt{block\_deim}: 70 \% of r\_k \& more."
    )


def test_settings_are_filled_in():
    settings = {"a.b": 1e-10}
    assert filled("up to {a.b} of", settings.__getitem__) == "up to $10^{-10}$ of"
    assert number(0.1) == "$0.1$"
    assert number(2.5e-7) == r"$2.5 \cdot 10^{-7}$"


HOSTILE = [
    ".. raw:: html\n\n   <script>alert(1)</script>",
    ".. include:: /etc/passwd",
    "|version| and `link <http://example.org>`_ and name_",
    "http://example.org and a@b.org",
    "*emphasis* **strong** ``literal`` :role:`x` [1]_ \\ ",
    "Heading\n=======",
]


def parsed(text):
    return publish_doctree(text, settings_overrides={"report_level": 5, "raw_enabled": True})


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_captions_are_dead_text(text):
    """Rendered as the report renders it (its settings allow raw parts and included files)."""
    tree = parsed(f"**{to_rst('Title')}.** {to_rst(text)}")
    (only,) = tree.children
    assert isinstance(only, paragraph)
    assert [child.tagname for child in only.children] == ["strong", "#text"]
    assert only.astext() == f"Title. {' '.join(to_plain(text).split())}"


@given(st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp"))))
def test_any_caption_is_one_paragraph_of_text(text):
    words = " ".join(to_plain(text).split())
    (only,) = parsed(f"**T.** {to_rst(text)}").children
    assert only.astext().strip() == f"T. {words}".strip()
    assert {child.tagname for child in only.children} <= {"strong", "#text"}


def test_captions_of_all_figures_read_well_as_plain_text():
    for name, figure in declarations().items():
        for text in (figure.title, figure.caption):
            plain = to_plain(filled(text, lambda key: 1e-3))
            assert not set(plain) & set("`$\\{}^"), name
