r"""Conversion of the mark-up of titles and captions to TeX and plain text.

In the mark-up, a name between backticks is set in typewriter, ``$r \le 20$`` is mathematics, and
``{key}`` stands for the value of a setting of the configuration.
"""

import re
from collections.abc import Callable

from study.artifact.text import escape

_MARK = re.compile(r"`([^`]*)`|\$([^$]*)\$")
_KEY = re.compile(r"\{([a-z_.]+)\}")


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
