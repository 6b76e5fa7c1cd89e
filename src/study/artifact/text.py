r"""Typeset texts that a user wrote, and titles and captions in mark-up.

pdfTeX typesets the manuscript with T1 fonts, which have Latin letters; Greek letters and signs
become formulas. Figures use DejaVu Sans, which has all these characters.

In the mark-up, a name between backticks is set in typewriter, ``$r \le 20$`` is mathematics, and
``{key}`` stands for the value of a setting of the configuration.
"""

import re
import unicodedata
from collections.abc import Callable
from typing import Any

from pdrom.core.errors import ConfigurationError, PaperError

_SPECIAL = {
    "\\": r"\textbackslash{}", "_": r"\_", "%": r"\%", "&": r"\&", "#": r"\#", "$": r"\$",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\textquotedbl{}",
}  # fmt: skip
# Latin letters that T1 fonts lack
_NO_LETTERS = "ĦħĸĿŀŉŦŧ"
_PUNCTUATION = "¡¿«»–—‘’‚“”„…‹›"
_SIGNS = {
    "±": r"\pm", "×": r"\times", "÷": r"\div", "·": r"\cdot", "¬": r"\neg", "°": r"{}^\circ",
    "¹": "{}^1", "²": "{}^2", "³": "{}^3", "µ": r"\mu", "−": "-", "∞": r"\infty", "√": r"\surd",
    "≤": r"\le", "≥": r"\ge", "≠": r"\ne", "≈": r"\approx", "≡": r"\equiv", "∝": r"\propto",
    "≪": r"\ll", "≫": r"\gg", "∈": r"\in", "∂": r"\partial", "∇": r"\nabla", "∑": r"\sum",
    "∏": r"\prod", "∫": r"\int", "→": r"\to", "←": r"\leftarrow", "↔": r"\leftrightarrow",
    "⇒": r"\Rightarrow", "∥": r"\parallel", "⊥": r"\perp", "∪": r"\cup", "∩": r"\cap",
    "ϑ": r"\vartheta", "ϕ": r"\phi", "ϱ": r"\varrho", "ϵ": r"\epsilon", "ς": r"\varsigma",
    "σ": r"\sigma", "φ": r"\varphi", "ε": r"\varepsilon", "ο": "o",
}  # fmt: skip
_GREEK = """alpha beta gamma delta zeta eta theta iota kappa lambda mu nu xi pi rho tau upsilon chi
psi omega sigma phi"""
# TeX has no commands for capital Greek letters that look like Latin ones.
_LATIN_CAPITALS = dict(zip("ΑΒΕΖΗΙΚΜΝΟΡΤΧ", "ABEZHIKMNOPTX", strict=True))
_MARK = re.compile(r"`([^`]*)`|\$([^$]*)\$")
_KEY = re.compile(r"\{([a-z_.]+)\}")


def escape(text: str) -> str:
    """Return TeX code of a plain ``text``; PaperError if a character cannot be typeset."""
    pieces = []
    for character in unicodedata.normalize("NFC", text):
        piece = _typeset(character)
        if piece is None:
            name = unicodedata.name(character, "a control character")
            named = f"'{character}' (U+{ord(character):04X}, {name})"
            raise PaperError(f"'{text}': {named} cannot be typeset")
        pieces.append(piece)
    return "".join(pieces)


def require_typeset(data: Any, place: str) -> None:
    """Raise ConfigurationError, with the key below ``place``, if TeX cannot typeset a text."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            require_typeset(value, f"{place}.{key}")
    elif isinstance(data, str):
        try:
            escape(data)
        except PaperError as error:
            raise ConfigurationError(
                f"{place} = {error} (allowed: Latin and Greek letters, digits, ASCII and common "
                "mathematical signs)"
            ) from error


def replaced(text: str) -> str:
    """Return ``text`` with question marks in place of characters that cannot be typeset."""
    characters = unicodedata.normalize("NFC", text)
    return "".join("?" if _typeset(character) is None else character for character in characters)


def _typeset(character: str) -> str | None:
    if character in _SPECIAL:
        return _SPECIAL[character]
    if " " <= character <= "~" or character in _PUNCTUATION:
        return character
    # T1 fonts have letters of Latin-1 and Latin Extended-A, and Romanian letters
    latin = "\u00c0" <= character <= "\u017e" or "\u0218" <= character <= "\u021b"
    if latin and character.isalpha() and character not in _NO_LETTERS:
        return character
    if character == "\N{NO-BREAK SPACE}":
        return "~"
    command = _SIGNS.get(character) or _LATIN_CAPITALS.get(character) or _greek(character)
    return None if command is None else rf"\ensuremath{{{command}}}"


def _greek(character: str) -> str | None:
    """Return the TeX command of a Greek letter without accents; None for other characters."""
    words = unicodedata.name(character, "").lower().replace("lamda", "lambda").split()
    if len(words) != 4 or words[::2] != ["greek", "letter"] or words[3] not in _GREEK.split():
        return None
    return "\\" + (words[3].capitalize() if words[1] == "capital" else words[3])


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
    pieces, end = [], 0
    for found in _MARK.finditer(text):
        pieces.append(escape(text[end : found.start()]))
        name, formula = found.groups()
        pieces.append(f"${formula}$" if name is None else rf"\texttt{{{escape(name)}}}")
        end = found.end()
    return "".join([*pieces, escape(text[end:])])


def to_plain(text: str) -> str:
    """Remove the marks of names and formulas from the mark-up ``text`` of a title."""
    return re.sub("[`$]", "", text)
