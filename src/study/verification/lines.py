"""Line with the outcome of one claim, figure or table, and the page that lists all lines."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from study.verification.subject import Status

# Largest number of differences per line that the page lists.
ON_PAGE = 20


class Outcome(StrEnum):
    """Outcome of the comparison of one claim, figure or table."""

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
    text : size and place of the largest difference, or a reason
    details : all differences as text, largest first
    """

    kind: str
    name: str
    outcome: Outcome
    text: str = ""
    details: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.kind} {self.name}: {self.outcome}" + (f", {self.text}" if self.text else "")


def status_of(lines: Iterable[Line]) -> Status:
    """Exit code of ``lines``: a missing result before a difference, else success."""
    outcomes = {line.outcome for line in lines}
    if Outcome.MISSING in outcomes:
        return Status.MISSING
    return max((STATUS.get(outcome, Status.HOLDS) for outcome in outcomes), default=Status.HOLDS)


def counted(lines: Sequence[Line]) -> str:
    """Numbers of ``lines`` by kind and outcome, as text."""
    parts = []
    for kind in dict.fromkeys(line.kind for line in lines):
        own = [line.outcome for line in lines if line.kind == kind]
        counts = ", ".join(f"{own.count(o)} {o}" for o in Outcome if o in own)
        parts.append(f"{kind}s: {counts}")
    return "; ".join(parts)


def page(lines: Sequence[Line], about: Sequence[str]) -> str:
    """Return the Markdown page of all ``lines``.

    Parameters
    ----------
    about : sentences on top of the page that say what was compared
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
