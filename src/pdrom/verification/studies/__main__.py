"""``python -m pdrom.verification.studies A B``: what ``./reproduce compare A B`` starts."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import ConfigurationError
from pdrom.core.store import require_place, write_text
from pdrom.verification.lines import Outcome
from pdrom.verification.status import ended
from pdrom.verification.studies.findings import Findings
from pdrom.verification.studies.page import page, verdict
from pdrom.verification.studies.sides import Side, place_of
from pdrom.verification.studies.times import ratios

EQUAL, DIFFERS, FAULTY = 0, 1, 2
PAGE = "comparison.html"


def parser() -> argparse.ArgumentParser:
    """Parser of the arguments after the word ``compare``."""
    made = argparse.ArgumentParser(
        prog="./reproduce compare",
        description="Two studies side by side: verdicts, tables, figures and times.",
        epilog="exit codes: 0 nothing differs beyond tolerance; 1 something does; 2 faulty input",
    )
    what = "folder of results, archive of ./reproduce bundle, or configuration that has results"
    made.add_argument("a", metavar="A", help=what)
    made.add_argument("b", metavar="B", help="the same")
    made.add_argument("--page", type=Path, default=Path(PAGE), metavar="FILE", help="page to write")
    return made


def compare(arguments: Sequence[str]) -> int:
    """Compare the two studies of the ``arguments``, write the page; the exit code.

    Raises
    ------
    ConfigurationError
        A study is not there, both are the same, or the page would lie in one of them.
    StorageError
        Results are missing, damaged, or none; the page cannot be written.
    """
    asked = parser().parse_args(arguments)
    places = [place_of(given) for given in (asked.a, asked.b)]
    _require_apart(places, asked.page)
    with TemporaryDirectory(prefix="pdrom-compare-") as room:
        rooms = [Path(room, name) for name in "AB"]
        for each in rooms:
            each.mkdir()
        a, b = map(Side.read, places, rooms)
        findings = Findings(a, b)
        lines = findings.lines()
        text = page(findings, lines, ratios(findings.comparisons))
    write_text(text, asked.page, with_checksum=False)
    for line in lines:
        if line.outcome in (Outcome.DIFFERS, Outcome.MISSING):
            sys.stdout.write(f"{line.kind} {line.name}: {line.outcome}, {line.text}\n")
    sys.stdout.write(f"{verdict(lines)}\npage: {asked.page}\n")
    return DIFFERS if any(line.outcome is Outcome.DIFFERS for line in lines) else EQUAL


def _require_apart(places: Sequence[Path], page: Path) -> None:
    a, b = (place.resolve() for place in places)
    if a == b:
        raise ConfigurationError(f"compare: {places[0]} and {places[1]} are the same study")
    for place in (a, b):
        if page.resolve() == place or place in page.resolve().parents:
            fault = f"lies in {place}, of which nothing is changed"
            raise ConfigurationError(f"compare: --page {page}: {fault}; name another place")
    if page.suffix != ".html":
        raise ConfigurationError(f"compare: --page {page}: the name has to end in .html")
    require_place(page)


if __name__ == "__main__":
    sys.exit(ended(lambda: compare(sys.argv[1:]), FAULTY))
