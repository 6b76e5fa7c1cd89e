"""Captions in light mark-up: TeX and plain words."""

from study.artifact.markup import filled, number, to_plain, to_tex
from study.figures.kit.declaration import declarations

CAPTION = "The gain $\\gamma \\le 10^{-3}$ of `block_deim`: 70 % of r_k & more."


def test_one_caption_two_ways():
    assert to_plain(CAPTION) == "The gain γ ≤ 10⁻³ of block_deim: 70 % of r_k & more."
    assert to_tex(CAPTION) == (
        r"The gain $\gamma \le 10^{-3}$ of \texttt{block\_deim}: 70 \% of r\_k \& more."
    )


def test_settings_are_filled_in():
    settings = {"a.b": 1e-10}
    assert filled("up to {a.b} of", settings.__getitem__) == "up to $10^{-10}$ of"
    assert number(0.1) == "$0.1$"
    assert number(2.5e-7) == r"$2.5 \cdot 10^{-7}$"


def test_captions_of_all_figures_read_well_as_plain_text():
    for name, figure in declarations().items():
        for text in (figure.title, figure.caption):
            plain = to_plain(filled(text, lambda key: 1e-3))
            assert not set(plain) & set("`$\\{}^"), name
