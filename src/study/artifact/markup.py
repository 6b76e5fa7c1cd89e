r"""Conversion of the mark-up of titles and captions to TeX and plain text.

In the mark-up, a name between backticks is set in typewriter, ``$r \le 20$`` is mathematics, and
``{key}`` stands for the value of a setting of the configuration.
"""

import re
from collections.abc import Callable

from study.artifact.text import escape

_Words = Callable[[str], str]
_MARK = re.compile(r"`([^`]*)`|\$([^$]*)\$")
_KEY = re.compile(r"\{([a-z_.]+)\}")
_SIGNS = {
    r"\gamma": "γ", r"\tau": "τ", r"\sigma": "σ", r"\le": "≤", r"\ge": "≥", r"\times": "×",
    r"\infty": "∞", r"\cdot": "·", r"\%": "%", r"\,": " ", "-": "−",
}  # fmt: skip
_SIGN = re.compile("|".join(sorted(map(re.escape, _SIGNS), key=len, reverse=True)))
_RAISED = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def filled(text: str, value: Callable[[str], float]) -> str:
    """Return ``text`` with each ``{key}`` replaced by the number that ``value`` returns for it."""
    return _KEY.sub(lambda found: number(value(found[1])), text)


def number(value: float) -> str:
    """Format ``value`` as a formula in mark-up; exponents become powers of ten."""
    mantissa, mark, exponent = f"{value:g}".partition("e")
    if not mark:
        return f"${mantissa}$"
    factor = "" if mantissa == "1" else rf"{mantissa} \cdot "
    return f"${factor}10^{{{int(exponent)}}}$"


def to_tex(text: str) -> str:
    """Convert the mark-up ``text`` to TeX."""
    return _converted(text, escape, lambda name: rf"\texttt{{{escape(name)}}}", lambda m: f"${m}$")


def to_plain(text: str) -> str:
    """Convert the mark-up ``text`` to plain words."""
    return _converted(text, str, str, _plain_mathematics)


def _converted(text: str, words: _Words, name: _Words, mathematics: _Words) -> str:
    pieces, end = [], 0
    for found in _MARK.finditer(text):
        pieces.append(words(text[end : found.start()]))
        pieces.append(name(found[1]) if found[1] is not None else mathematics(found[2]))
        end = found.end()
    return "".join([*pieces, words(text[end:])])


def _plain_mathematics(formula: str) -> str:
    """Convert a formula to plain text with Unicode signs, exponents and indices."""
    text = _SIGN.sub(lambda found: _SIGNS[found[0]], formula)
    text = re.sub(r"\^(?:\{([^{}]*)\}|(.))", lambda f: (f[1] or f[2]).translate(_RAISED), text)
    text = re.sub(r"_(?:\{([^{}]*)\}|(.))", lambda f: (f[1] or f[2]).translate(_LOWERED), text)
    return text.replace("{", "").replace("}", "")
