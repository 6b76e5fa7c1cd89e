"""Optional blocks of the manuscript, which are left out if their numbers are missing."""

import pytest

from builders import frame
from pdrom.core.errors import PaperError
from study.paper import macros as tex
from study.paper.numbers import Entry

HELD = {"runs": frame("scene method outcome error end", ("bar", "pod", "wrong", 0.5, None))}
KNOWN = {
    name: Entry(table="runs", rows={"scene": name}, column="error") for name in ("bar", "cloth")
}
BAR, CLOTH = r"\n{bar}", r"\n{cloth}"
BLOCKS = rf"""\known{{The bar has {BAR} \emph{{so}}.}} Always. \known{{The cloth has {CLOTH}.}}
\known{{And {CLOTH} again.}}

Next. \known{{Both: {BAR}, {CLOTH}.}}
"""


@pytest.mark.parametrize("source", [r"\known{open {x}", r"\known{a \known{b} c}"])
def test_a_faulty_optional_block_is_named(source):
    with pytest.raises(PaperError, match=r"contains another|not closed"):
        tex.sentences(source)


def test_an_optional_block_is_shown_only_with_all_of_its_numbers_and_its_figure():
    made = tex.decisions(BLOCKS, KNOWN, HELD)
    assert made == ["shown", "dropped", "dropped", "dropped"]
    picture = r"\known{\pictureof{bars}{Bars.}}"
    assert tex.decisions(picture, KNOWN, HELD, ["bars"]) == ["shown"]
    assert tex.decisions(picture, KNOWN, HELD, ["sheets"]) == ["dropped"]


def test_the_text_names_the_configuration_that_it_was_made_from():
    text = tex.provenance({"main": ["dropped"]}, "config/tiny.yaml", "config/default.yaml")
    assert r"\parttrue" in text
    assert r"\newcommand{\configuration}{\texttt{config/tiny.yaml}}" in text
    assert r"\partfalse" in tex.provenance({}, None, "config/default.yaml")
