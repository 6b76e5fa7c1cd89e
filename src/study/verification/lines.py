"""One line for each claim, figure and table, and the page that holds them all."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from study.verification.status import Status

# Differences of one line that the page names.
ON_PAGE = 20


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
        for line in lines:
            if line.kind == kind:
                text = line.text.replace("|", "\\|")
                parts.append(f"| {line.name} | {line.outcome} | {text} |")
        parts.append("")
    differing = [line for line in lines if line.details]
    parts += ["## What differs", ""] if differing else []
    for line in differing:
        shown, more = line.details[:ON_PAGE], len(line.details) - ON_PAGE
        parts += [f"### {line.kind} {line.name}", "", *(f"- {text}" for text in shown)]
        parts += [f"- and {more} more", ""] if more > 0 else [""]
    return "\n".join(parts)
