"""One line for each claim, figure and table, and the page that holds them all."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from study.verification.judge import Judgement
from study.verification.status import Status

# Differences that a line names; the page names more.
NAMED, ON_PAGE = 1, 20


class Outcome(StrEnum):
    """Outcome of one comparison."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    NOT_COMPARABLE = "not comparable on this machine"
    NO_REFERENCE = "no reference"
    MISSING = "not there"


STATUS = {Outcome.DIFFERS: Status.DIFFERS, Outcome.NO_REFERENCE: Status.DIFFERS}


@dataclass(frozen=True)
class Line:
    """Outcome of one claim, figure or table.

    kind : claim, figure or table
    text : by how much, where, or why
    details : everything that differs, worst first
    """

    kind: str
    name: str
    outcome: Outcome
    text: str = ""
    details: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.kind} {self.name}: {self.outcome}" + (f", {self.text}" if self.text else "")


def table_line(judgement: Judgement, measured: bool, lacking: Sequence[str] = ()) -> Line:
    """Line of a table by the ``judgement`` on it.

    Parameters
    ----------
    measured : whether a column is compared that is no name or size
    lacking : columns that its reference does not have
    """
    name, differences = judgement.name, judgement.differences
    details = tuple(map(str, differences))
    if differences:
        more = f" and {len(details) - NAMED} more" if len(details) > NAMED else ""
        return Line("table", name, Outcome.DIFFERS, f"{details[0]}{more}", details)
    if lacking:
        text = f"column(s) {', '.join(lacking)}: run verify --update"
        return Line("table", name, Outcome.NO_REFERENCE, text)
    if not measured:
        text = "its numbers are times or round-off; names and sizes agree"
        return Line("table", name, Outcome.NOT_COMPARABLE, text)
    return Line("table", name, Outcome.REPRODUCED, _cells(judgement))


def _cells(judgement: Judgement) -> str:
    if judgement.compared == 0:
        return "it has no rows"
    text = f"{judgement.compared} cells"
    if judgement.loose:
        reasons = ", ".join(f"{reason} {n}" for reason, n in judgement.loose.most_common())
        text += f"; by count: {reasons}"
    return text


def status_of(lines: Iterable[Line]) -> Status:
    """Exit code of ``lines``: something is missing, else something differs, else all holds."""
    outcomes = {line.outcome for line in lines}
    if Outcome.MISSING in outcomes:
        return Status.MISSING
    return max((STATUS.get(outcome, Status.HOLDS) for outcome in outcomes), default=Status.HOLDS)


def counted(lines: Sequence[Line]) -> str:
    """Counts of ``lines`` by kind and outcome."""
    parts = []
    for kind in dict.fromkeys(line.kind for line in lines):
        own = [line.outcome for line in lines if line.kind == kind]
        counts = ", ".join(f"{own.count(o)} {o}" for o in Outcome if o in own)
        parts.append(f"{kind}s: {counts}")
    return "; ".join(parts)


def page(lines: Sequence[Line], about: Sequence[str]) -> str:
    """Markdown of all lines.

    Parameters
    ----------
    about : sentences about what was compared with what
    """
    parts = ["# Verification", "", *about, "", counted(lines) + ".", ""]
    for kind in dict.fromkeys(line.kind for line in lines):
        parts += [f"## {kind.capitalize()}s", "", f"| {kind} | outcome | what |", "|---|---|---|"]
        parts += [
            f"| {line.name} | {line.outcome} | {_cell(line.text)} |"
            for line in lines
            if line.kind == kind
        ]
        parts.append("")
    differing = [line for line in lines if line.details]
    if differing:
        parts += ["## What differs", ""]
    for line in differing:
        shown = line.details[:ON_PAGE]
        more = [f"- and {len(line.details) - ON_PAGE} more"] if len(line.details) > ON_PAGE else []
        parts += [f"### {line.kind} {line.name}", "", *(f"- {text}" for text in shown), *more, ""]
    return "\n".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
