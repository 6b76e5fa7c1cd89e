"""docs/claim_map.md and the README's table, from the declarations and the expected verdicts."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pdrom.core.paths import RESULTS
from pdrom.report.figure_numbers import Numbers, figure_numbers
from pdrom.tables import declared
from pdrom.tables.kit.declaration import Table
from pdrom.tables.kit.quantities import QUANTITIES
from pdrom.verification.claim_map.entries import Entry, entries
from pdrom.verification.references import folder_of, read_reference

PAGE = Path("docs/claim_map.md")
README = Path("README.md")
SECTION = re.compile(r"(<!-- claim map -->\n).*?(<!-- end of the claim map -->)", re.DOTALL)
UNKNOWN = "–"

Verdicts = Mapping[str, tuple[str, str]]

HEAD = """\
# Claim map

Every claim, figure, table and number of the text, with what makes it; `./reproduce pages` wrote it.
Every run of a whole study writes `results/claim_map.csv` (other configurations: below
`results/studies/NAME`) with what each line took on its machine: processor time from nothing
(`minutes`) and of the last job (`minutes_alone`), the largest memory and the disk (MB).

* Verdicts are the expected ones of the full study.
* A number with S is one of the supplement.
* A dash: the figure is not in that document.
* **columns**: the number of columns of each kind, which says how exactly `./reproduce verify`
  expects them ([how](verification.md)).
* A figure is reproduced when the tables that it reads are, a claim when its verdict is the same.
* The rule is `figure_NAME` for a figure, `NAME_table` for a table, `paper` for the manuscript.
  A number of the text is read by `paper_inputs`.
"""


def claim_pages(root: Path) -> dict[Path, str]:
    """Text of both pages by their place below ``root``."""
    listed, numbers, verdicts = entries(root), figure_numbers(root), expected_verdicts(root)
    readme = (root / README).read_text(encoding="utf-8")
    return {
        PAGE: _page(listed, numbers, verdicts),
        README: SECTION.sub(rf"\g<1>{_short(listed, numbers, verdicts)}\g<2>", readme),
    }


def expected_verdicts(root: Path) -> Verdicts:
    """Verdicts of each claim as published and beyond, by the tables that ``root`` keeps."""
    found = read_reference(declared()["claims"], root / folder_of(RESULTS))
    assert found, "the repository keeps no table claims"
    rows = found.frame.set_index("claim")
    return {str(name): (row.verdict, row.verdict_beyond) for name, row in rows.iterrows()}


def _page(listed: list[Entry], numbers: Mapping[str, Numbers], verdicts: Verdicts) -> str:
    def section(kind: str, head: str, row: Callable[[Entry], Iterable[str]]) -> str:
        return _table(head, [row(entry) for entry in listed if entry.kind == kind])

    parts = [
        HEAD,
        "## Claims\n\nThe table `claims` has the verdicts and the rows that they rest on: "
        "`./reproduce claims`.\nA claim is seen in the first of the names, which have lines of "
        "their own below.\n",
        section(
            "claim",
            "| claim | the preprint | as published | beyond | seen in, rests on |",
            lambda e: (e.name, e.title, *verdicts[e.name], _names(e.rests_on)),
        ),
        "## Figures\n",
        section(
            "figure",
            "| figure | paper | preprint | command |",
            lambda e: (f"[{e.name}](figures.md)", *_places(numbers[e.name]), _command(e)),
        ),
        "## Tables\n",
        section(
            "table",
            "| table | command | columns |",
            lambda e: (
                f"[{e.name}](tables.md#{e.name})",
                _command(e),
                _tolerances(declared()[e.name]),
            ),
        ),
        "## Numbers of the text\n\nTables from which each section reads its numbers.\n",
        section("section", "| section | tables |", lambda e: (e.title, _names(e.rests_on))),
        "## The manuscript\n",
        section(
            "manuscript",
            "| files | command |",
            lambda e: (", ".join(f"`{file}`" for file in e.files), _command(e)),
        ),
    ]
    return "\n".join(parts)


def _short(listed: list[Entry], numbers: Mapping[str, Numbers], verdicts: Verdicts) -> str:
    """Claims and the preprint's figures, each with one command."""
    by_name = {e.name: e for e in reversed(listed) if e.kind in ("figure", "table")}
    claims = [e for e in listed if e.kind == "claim"]
    shown = {e.rests_on[0] for e in claims}
    lines = [
        (f"{e.name}: {e.title}", *verdicts[e.name], _command(by_name[e.rests_on[0]]))
        for e in claims
    ]
    lines += [
        (f"{e.title} ({numbers[e.name].words})", "", "", _command(e))
        for e in listed
        if e.kind == "figure" and numbers[e.name].preprint and e.name not in shown
    ]
    return _table("| claim or figure | as published | beyond | command |", lines)


def _places(numbers: Numbers) -> tuple[str, str]:
    return numbers.manuscript or UNKNOWN, str(numbers.preprint or UNKNOWN)


def _tolerances(table: Table) -> str:
    """Exactness that is expected of a table: the number of columns of each kind."""
    held = Counter(column.quantity for column in table.columns)
    return ", ".join(f"{held[kind]} {kind}" for kind in QUANTITIES if held[kind])


def _command(entry: Entry) -> str:
    return f"`{' '.join(['./reproduce', *entry.words])}`"


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _table(head: str, rows: Iterable[Iterable[str]]) -> str:
    line = "|" + "---|" * (head.count("|") - 1)
    return "\n".join([head, line, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"
