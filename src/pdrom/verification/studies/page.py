"""The page of a comparison: one file, with the pictures of the figures that are not the same."""

import base64
import io
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from math import log2
from pathlib import Path

from PIL import Image

from pdrom.core.paths import FIGURE_PICTURE
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.report.live.page import filled
from pdrom.report.words.markup import to_plain
from pdrom.tables import declared
from pdrom.tables.kit.intervals import in_words
from pdrom.verification.lines import ON_PAGE, Line, Outcome
from pdrom.verification.studies.findings import Findings
from pdrom.verification.studies.times import Ratio

WIDTH = 900  # of a picture, in pixels
WORDS = {
    Outcome.DIFFERS: "differ",
    Outcome.MISSING: "not there",
    Outcome.NOT_COMPARABLE: "not judged",
    Outcome.REPRODUCED: "agree",
}
SVG = '<svg viewBox="-2 0 104 10" aria-hidden="true"><path d="M50 0V10"/>'
LIKE = "Equal settings and code made both, so that each row has to be on both sides."
UNLIKE = "Other settings or code made them: rows and columns of one side are named and not judged."


def page(findings: Findings, lines: Sequence[Line], times: Iterable[Ratio]) -> str:
    """HTML of a comparison.

    Parameters
    ----------
    lines : those of ``findings``
    times : of the rows that both studies have
    """
    differs = any(line.outcome is Outcome.DIFFERS for line in lines)
    parts = {
        "STYLE": _asset("report.live", "live.css") + _asset("verification.studies", "page.css"),
        "CLASS": "differ" if differs else "agree",
        "VERDICT": escape(verdict(lines)),
        "HOW": LIKE if findings.alike else UNLIKE,
        "SIDES": _sides(findings),
        "TIMES": "".join(map(_time, times)),
    }
    for kind in ("claim", "table", "figure"):
        parts[kind.upper()] = _section(findings, [line for line in lines if line.kind == kind])
    return filled(_asset("verification.studies", "page.html"), parts)


def verdict(lines: Sequence[Line]) -> str:
    """Sentence about how many lines of each kind differ."""
    kinds = Counter(line.kind for line in lines if line.outcome is Outcome.DIFFERS)
    counts = ", ".join(f"{count} {kind}{'s' * (count > 1)}" for kind, count in kinds.items())
    many = f"{kinds.total()} of {len(lines)} differ beyond tolerance: {counts}."
    return many if kinds else "Nothing differs beyond tolerance."


def _asset(package: str, name: str) -> str:
    return files(f"pdrom.{package}").joinpath(name).read_text(encoding="utf-8")


def _sides(findings: Findings) -> str:
    """Rows of facts; those that differ are set apart."""
    a, b = ({"results": side.name} | side.facts for side in (findings.a, findings.b))
    return "".join(
        _row(name, a.get(name, ""), b.get(name, ""), name="other" * (a.get(name) != b.get(name)))
        for name in a | b
    )


def _row(head: str, *cells: str, name: str = "", more: str = "") -> str:
    data = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
    return f'<tr class="{name}"><th scope="row">{escape(head)}</th>{data}{more}</tr>'


def _section(findings: Findings, lines: Sequence[Line]) -> str:
    """Lines by outcome; only what differs is unfolded."""
    groups: dict[tuple[Outcome, bool], list[Line]] = {}
    for line in lines:
        in_part = line.outcome is Outcome.REPRODUCED and bool(_left(findings, line))
        groups.setdefault((line.outcome, in_part), []).append(line)
    found = []
    for outcome, in_part in sorted(groups, key=lambda key: (list(WORDS).index(key[0]), not key[1])):
        own = groups[outcome, in_part]
        shown = "".join(_item(findings, line) for line in own)
        unfold = " open" if outcome in (Outcome.DIFFERS, Outcome.MISSING) else ""
        count = f"{WORDS[outcome]}{' in what both have' * in_part}: {len(own)}"
        found.append(f"<details{unfold}><summary>{count}</summary><dl>{shown}</dl></details>")
    return "".join(found) or "<p>None on either side.</p>"


def _left(findings: Findings, line: Line) -> list[str]:
    return findings.left.get(line.name, []) if line.kind == "table" else []


def _item(findings: Findings, line: Line) -> str:
    more = [f"and {len(line.details) - ON_PAGE} more"] if len(line.details) > ON_PAGE else []
    texts = [*(line.details[:ON_PAGE] or filter(None, [line.text])), *more, *_left(findings, line)]
    body = "".join(f"<dd>{escape(text)}</dd>" for text in texts)
    shown = line.kind == "figure" and line.outcome in (Outcome.DIFFERS, Outcome.NOT_COMPARABLE)
    pictures = _pictures(findings, line.name) if shown else ""
    term = f'<dt class="{WORDS[line.outcome].split()[0]}">{escape(line.name)}'
    return f"<div>{term} <span>{escape(_title(findings, line))}</span></dt>{body}{pictures}</div>"


def _title(findings: Findings, line: Line) -> str:
    if line.kind == "claim":
        return findings.claims.get(line.name, "")
    known = declared() if line.kind == "table" else declarations()
    return to_plain(known[line.name].title) if line.name in known else ""


def _pictures(findings: Findings, name: str) -> str:
    place = FIGURE_PICTURE.at("", name=name)[1:]
    both = {"A": findings.a.file(place), "B": findings.b.file(place)}
    cells = (
        f'<figure><figcaption>{side}</figcaption><img alt="{escape(name)}, study {side}" '
        f'loading="lazy" src="data:image/png;base64,{_small(path)}"></figure>'
        for side, path in both.items()
    )
    return f'<dd class="pictures">{"".join(cells)}</dd>'


def _small(path: Path) -> str:
    packed = io.BytesIO()
    with Image.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((WIDTH, 10 * WIDTH))
        small.quantize(128).save(packed, "PNG", optimize=True)
    return base64.b64encode(packed.getvalue()).decode()


def _time(ratio: Ratio) -> str:
    """Row of a ratio; its picture reaches from a quarter to four times."""
    median, low, high = (
        50 + 25 * min(2.0, max(-2.0, log2(v))) for v in (ratio.median, ratio.low, ratio.high)
    )
    interval = f'<path class="interval" d="M{low:.1f} 5H{high:.1f}"/>'
    point = f'<circle cx="{median:.1f}" cy="5" r="2"/>'
    words = in_words(ratio.median, ratio.low, ratio.high)
    picture = f"<td>{SVG}{interval}{point}</svg></td>"
    counts = f"<td>{ratio.scenes}</td><td>{ratio.rows}</td>"
    return _row(f"{ratio.table} {ratio.column}", words, more=picture + counts)
