"""Captions in light mark-up become TeX; titles become plain words."""

from study.artifact.text import filled, number, to_plain, to_tex
from study.figures.kit.declaration import declarations

CAPTION = "The gain $\\gamma \\le 10^{-3}$ of `block_deim`: 70 % of r_k & more."


def test_names_and_formulas_of_a_caption_become_tex():
    assert to_tex(CAPTION) == (
        r"The gain $\gamma \le 10^{-3}$ of \texttt{block\_deim}: 70 \% of r\_k \& more."
    )


def test_settings_are_inserted_into_a_caption():
    settings = {"a.b": 1e-10}
    assert filled("up to {a.b} of", settings.__getitem__) == "up to $10^{-10}$ of"
    assert number(0.1) == "$0.1$"
    assert number(2.5e-7) == r"$2.5 \cdot 10^{-7}$"


def test_titles_of_figures_have_no_formulas():
    for name, figure in declarations().items():
        assert not set(to_plain(figure.title)) & set("\\{}^"), name
