"""docs/claim_map.md and the README's table, from the declarations and a measured run.

``python -m pdrom.verification.claim_map.pages`` writes both. With the map of a finished run as its
argument (results/claim_map.csv) this becomes the measurement that the repository keeps.
"""

import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.errors import PdromError
from pdrom.core.store import read_table
from pdrom.pipeline.tracked import write_tracked
from pdrom.report.figure_numbers import Numbers, figure_numbers
from pdrom.tables import declared
from pdrom.tables.kit.declaration import Table
from pdrom.tables.kit.quantities import QUANTITIES
from pdrom.verification.claim_map.entries import Entry, entries
from pdrom.verification.claim_map.measured import COLUMNS

REFERENCE = Path("results/reference/claim_map.csv")
PAGE = Path("docs/claim_map.md")
README = Path("README.md")
SECTION = re.compile(r"(<!-- claim map -->\n).*?(<!-- end of the claim map -->)", re.DOTALL)
UNKNOWN = "–"

Row = Mapping[str, Any]
Measured = Mapping[tuple[str, str], Row]

HEAD = """\
# Claim map

What each claim, figure, table and number of the text is made by, and what that takes. Made from the
declarations and from the map of a finished run by
`.venv/bin/python -m pdrom.verification.claim_map.pages`; a test compares the two. Every run of a
whole study writes a map of its own, `results/claim_map.csv` (other configurations: below
`results/studies/NAME`).

{measured}

* **minutes**: processor time of all jobs that are needed from nothing, compilation of the kernels
  in a first run included, the workflow's own work not. What is there already is not made again.
  Jobs share the cores, but for those that take times, which run alone.
* **alone**: processor time of the last job, when all that it reads is there.
* **memory**: the largest resident memory of one of these jobs, MB. **disk**: what they write, MB.
* A dash: that run did not measure it, or a figure does not stand there.
* **columns**: how many of each kind, which says how exactly `./reproduce verify` expects them
  ([how](verification.md)). A figure is reproduced when the tables that it reads are, a claim when
  its verdict is the same.
* The rule is `figure_NAME` for a figure, `NAME_table` for a table, `paper` for the manuscript; a
  number of the text is read by `paper_inputs`.
"""


def pages(root: Path, measured: Measured) -> dict[Path, str]:
    """Text of both pages by their place below ``root``."""
    listed, numbers = entries(root), figure_numbers(root)
    readme = (root / README).read_text(encoding="utf-8")
    return {
        PAGE: _page(listed, numbers, measured),
        README: SECTION.sub(rf"\g<1>{_short(listed, numbers, measured)}\g<2>", readme),
    }


def load(root: Path) -> Measured:
    """The measurement that the repository keeps, by kind and name; empty before the first one."""
    if not (root / REFERENCE).is_file():
        return {}
    table = read_table(root / REFERENCE, COLUMNS, result=False)
    return {(row["kind"], row["name"]): row for row in table.to_dict("records")}


def _page(listed: list[Entry], numbers: Mapping[str, Numbers], measured: Measured) -> str:
    def section(kind: str, head: str, row: Callable[[Entry, Row], Iterable[str]]) -> str:
        lines = [row(entry, measured.get(entry.key, {})) for entry in listed if entry.kind == kind]
        return _table(head, lines)

    parts = [
        HEAD.format(measured=_origin(measured)),
        "## Claims\n\nThe verdicts, and the rows that they rest on, are in the table `claims`: "
        "`./reproduce claims`. A claim is seen in the first of the names, which have lines of "
        "their own below.\n",
        section(
            "claim",
            "| claim | the preprint | as published | beyond | seen in, rests on |",
            lambda e, row: (e.name, e.title, *_verdicts(row), _names(e.rests_on)),
        ),
        "## Figures\n",
        section(
            "figure",
            f"| figure | main.pdf | preprint | command | {COSTS} |",
            lambda e, row: (
                f"[{e.name}](figures.md)",
                *_places(numbers[e.name]),
                _command(e),
                *_costs(row),
            ),
        ),
        "## Tables\n",
        section(
            "table",
            f"| table | command | {COSTS} | columns |",
            lambda e, row: (
                f"[{e.name}](tables.md#{e.name})",
                _command(e),
                *_costs(row),
                _tolerances(declared()[e.name]),
            ),
        ),
        "## Numbers of the text\n\nBy section of the manuscript: the tables that its numbers are "
        "read from. The command makes these tables.\n",
        section(
            "section",
            f"| section | tables | {COSTS} |",
            lambda e, row: (e.title, _names(e.rests_on), *_costs(row)),
        ),
        "## The manuscript\n",
        section(
            "manuscript",
            f"| file | command | {COSTS} |",
            lambda e, row: (f"`{e.name}`", _command(e), *_costs(row)),
        ),
    ]
    return "\n".join(parts)


COSTS = "minutes | alone | memory | disk"


def _short(listed: list[Entry], numbers: Mapping[str, Numbers], measured: Measured) -> str:
    """Claims and the preprint's figures, each with one command."""
    by_name = {e.name: e for e in reversed(listed) if e.kind in ("figure", "table")}
    claims = [e for e in listed if e.kind == "claim"]
    shown = {e.rests_on[0] for e in claims}
    lines = [
        (
            f"{e.name}: {e.title}",
            *_verdicts(measured.get(e.key, {})),
            *_seen(by_name[e.rests_on[0]], measured),
        )
        for e in claims
    ]
    lines += [
        (f"{e.title} ({numbers[e.name].words})", "", "", *_seen(e, measured))
        for e in listed
        if e.kind == "figure" and numbers[e.name].preprint and e.name not in shown
    ]
    return _table("| claim or figure | as published | beyond | command | minutes |", lines)


def _seen(entry: Entry, measured: Measured) -> tuple[str, str]:
    return _command(entry), _number(measured.get(entry.key, {}).get("minutes"))


def _origin(measured: Measured) -> str:
    rows = list(measured.values())
    if not rows:
        return "Nothing was measured yet."
    return f"Measured by the run of `{rows[0]['configuration']}` on {rows[0]['machine']}."


def _places(numbers: Numbers) -> tuple[str, str]:
    return str(numbers.manuscript or UNKNOWN), str(numbers.preprint or UNKNOWN)


def _tolerances(table: Table) -> str:
    """How exactly a table is expected: the number of columns of each kind."""
    held = Counter(column.quantity for column in table.columns)
    return ", ".join(f"{held[kind]} {kind}" for kind in QUANTITIES if held[kind])


def _command(entry: Entry) -> str:
    return f"`{' '.join(['./reproduce', *entry.words])}`"


def _verdicts(row: Row) -> tuple[str, str]:
    return _text(row.get("verdict")), _text(row.get("verdict_beyond"))


def _costs(row: Row) -> list[str]:
    return [_number(row.get(key)) for key in ("minutes", "minutes_alone", "memory", "disk")]


def _text(cell: Any) -> str:
    return UNKNOWN if cell is None or pd.isna(cell) else str(cell)


def _number(cell: Any) -> str:
    """Two significant digits, and whole numbers from ten on."""
    if cell is None or pd.isna(cell):
        return UNKNOWN
    return f"{cell:.0f}" if cell >= 10.0 else f"{float(f'{cell:.2g}'):g}"


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _table(head: str, rows: Iterable[Iterable[str]]) -> str:
    line = "|" + "---|" * (head.count("|") - 1)
    return "\n".join([head, line, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def main(arguments: list[str]) -> None:
    """Take over a measurement, if one is given, and write the pages."""
    if arguments:
        # read first, so that a damaged or foreign file replaces nothing
        read_table(arguments[0], COLUMNS)
        REFERENCE.parent.mkdir(parents=True, exist_ok=True)
        write_tracked(REFERENCE, Path(arguments[0]).read_bytes())
    for place, text in pages(Path(), load(Path())).items():
        place.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except PdromError as error:
        sys.exit(f"pdrom: {error}")
