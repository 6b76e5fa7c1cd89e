"""Captions in light mark-up: TeX, plain words, and reStructuredText without a living sign."""

from docutils.core import publish_doctree
from docutils.nodes import paragraph
from hypothesis import example, given
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


@given(st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp"))))
@example(".. raw:: html\n\n   <script>alert(1)</script>")
@example(".. include:: /etc/passwd")
@example("|version| and `link <http://example.org>`_ and name_")
@example("http://example.org and a@b.org")
@example("*emphasis* **strong** ``literal`` :role:`x` [1]_ \\ ")
@example("Heading\n=======")
def test_any_caption_is_one_paragraph_of_dead_text(text):
    """Rendered as the report renders it (its settings allow raw parts and included files)."""
    words = " ".join(to_plain(text).split())
    settings = {"report_level": 5, "raw_enabled": True}
    tree = publish_doctree(f"**{to_rst('Title')}.** {to_rst(text)}", settings_overrides=settings)
    (only,) = tree.children
    assert isinstance(only, paragraph)
    assert only.astext().strip() == f"Title. {words}".strip()
    assert {child.tagname for child in only.children} <= {"strong", "#text"}


def test_captions_of_all_figures_read_well_as_plain_text():
    for name, figure in declarations().items():
        for text in (figure.title, figure.caption):
            plain = to_plain(filled(text, lambda key: 1e-3))
            assert not set(plain) & set("`$\\{}^"), name
