"""Compare the claims, figures and tables of a results folder with the expected ones."""

from collections.abc import Iterable, Mapping
from enum import StrEnum
from functools import cache, cached_property, partial
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import Condition, check_file, read_table
from study.artifact.paths import TABLE
from study.pipeline.plan import Job
from study.pipeline.unfit import UNUSUAL, faults
from study.tables import declared
from study.tables.claims.claims import RULES, timed_columns
from study.tables.claims.rules import load_claims
from study.verification import compare
from study.verification.compare import Reference, folder_of, read_references
from study.verification.subject import Subject, differing, is_derived

# Columns of the table claims with verdicts, and their names in messages.
VERDICTS = {"verdict": "as published", "verdict_beyond": "improved methods"}


class Outcome(StrEnum):
    """Result of comparing a claim, figure or table with the expected one, the best first."""

    REPRODUCED = "reproduced"
    NOT_COMPARABLE = "not comparable on this machine"
    NO_REFERENCE = "no reference"
    DIFFERS = "differs"
    MISSING = "not there"


class Line(NamedTuple):
    """Outcome of comparing one claim, figure or table with the expected one.

    kind : claim, figure or table; file if the line is about a result that does not fit the plan
    text : largest difference with its row and column, or the reason for the outcome
    details : all differences as text, largest first
    """

    kind: str
    name: str
    outcome: Outcome
    text: str = ""
    details: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.kind} {self.name}: {self.outcome}" + (f", {self.text}" if self.text else "")


GOOD = (Outcome.REPRODUCED, Outcome.NOT_COMPARABLE)


class Examination:
    """Comparison of the results of a configuration with the expected ones."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject

    @cache  # noqa: B019 : the number of files limits the size of the cache
    def intact(self, path: str) -> bool:
        """Return whether the file ``path`` exists and agrees with its checksum."""
        return Path(path).is_file() and check_file(path) is Condition.INTACT

    def lines(self) -> list[Line]:
        """Return the outcomes of claims, figures, tables, and files that do not fit the study."""
        tables = {name: self.table(name) for name in declared()}
        figures = [self._figure(job, tables) for job in self.subject.plan.fixed["figures"]]
        there = sorted(Path(TABLE.at(self.subject.results, name="any")).parent.glob("[!.]*.csv"))
        foreign = [
            Line("table", path.stem, Outcome.DIFFERS, f"the study has no table {path}")
            for path in there
            if path.stem not in declared()
        ]
        unfit = [
            Line("file", path, Outcome.MISSING, f"{fault}; run {self.subject.command()}")
            for path, fault in faults(self.subject.plan).items()
            if fault in UNUSUAL
        ]
        return [*self.claims(tables["claims"]), *figures, *tables.values(), *foreign, *unfit]

    @cache  # noqa: B019 : the number of tables limits the size of the cache
    def found(self, name: str) -> pd.DataFrame:
        """Return table ``name`` of the results folder with all declared columns.

        Raises StorageError if its file is missing or damaged, or has columns not declared.
        """
        path, table = TABLE.at(self.subject.results, name=name), declared()[name]
        if missing := self._missing(name, [path]):
            raise StorageError(missing)
        frame = read_table(path, table.column_names)
        if other := sorted(set(frame) - set(table.column_names)):
            raise StorageError(f"{path}: has the unknown column(s) {', '.join(other)}")
        return table.checked(frame)

    @cached_property
    def expected(self) -> dict[str, Reference]:
        """Name of a table -> its expected version, if one exists."""
        return read_references(folder_of(self.subject.results))

    @cached_property
    def context(self) -> compare.Context:
        """Properties of scenes and runs from which the unstable table rows follow."""
        tables = {name: reference.frame for name, reference in self.expected.items()}
        try:
            return compare.Context(tables, self.found(compare.RUNS))
        except StorageError:
            return compare.Context(tables)

    def outdated(self, name: str) -> bool:
        """Return whether table ``name`` reads only tables and differs when it is made again."""
        job = self.subject.plan.job(declared()[name])
        tables = [path for path in job.files if path.startswith("results/")]
        return is_derived(name) and all(map(self.intact, tables)) and bool(differing(job))

    def table(self, name: str) -> Line:
        """Compare the table ``name`` with the expected one and return the outcome."""
        line, table = partial(Line, "table", name), declared()[name]
        try:
            frame = self.found(name)
        except StorageError as error:
            there = self.intact(TABLE.at(self.subject.results, name=name))
            return line(Outcome.DIFFERS if there else Outcome.MISSING, str(error))
        if name not in self.expected:
            return line(Outcome.NO_REFERENCE, "to accept it, run verify --update")
        if self.outdated(name):
            return line(Outcome.DIFFERS, "the tables that it reads give another result")
        reference, columns = self.expected[name], compare.kept(table)
        known = frame.assign(**dict.fromkeys(set(frame) - set(reference.columns)))
        found = compare.Comparison(table, reference.frame, table.checked(known), self.context)
        if differences := found.messages():
            more = f" and {len(differences) - 1} more" if differences[1:] else ""
            return line(Outcome.DIFFERS, differences[0] + more, tuple(differences))
        if new := [column.name for column in columns if column.name not in reference.columns]:
            return line(Outcome.NO_REFERENCE, f"new column(s) {', '.join(new)}: verify --update")
        if all(map(compare.identifies, columns)):
            text = "its numbers are times or rounding errors; names and sizes agree"
            return line(Outcome.NOT_COMPARABLE, text)
        return line(Outcome.REPRODUCED, f"{len(frame)} rows")

    def claims(self, table: Line) -> list[Line]:
        """Return the outcome of each claim, or of their ``table`` if this cannot be used."""
        unusable = table.outcome is not Outcome.REPRODUCED and not table.details
        found = None if unusable else self.found("claims").set_index("claim")
        if found is None or not found.index.is_unique:
            return [table._replace(kind="claim", name="all", details=())]
        expected = self.expected["claims"].frame.set_index("claim")
        names = dict.fromkeys([*expected.index, *found.index])
        return [_claim(str(name), expected, found) for name in names]

    def _missing(self, name: str, paths: Iterable[str]) -> str:
        lost = next((path for path in paths if not self.intact(path)), None)
        how = self.subject.command(name)
        return f"{lost} is missing or damaged; run {how}" if lost else ""

    def _figure(self, figure: Job, tables: Mapping[str, Line]) -> Line:
        line = partial(Line, "figure", figure.artifact.name)
        paths = {TABLE.at(self.subject.results, name=name): name for name in tables}
        read = [tables[paths[path]] for path in figure.files if path in paths]
        others = [p for p in figure.files if p.startswith("results/") and p not in paths]
        if missing := self._missing(figure.artifact.name, [*figure.outputs.values(), *others]):
            return line(Outcome.MISSING, missing)
        names = ", ".join(table.name for table in read)
        if bad := [table for table in read if table.outcome not in GOOD]:
            return line(bad[0].outcome, f"it shows the table(s) {', '.join(b.name for b in bad)}")
        timed = read and all(table.outcome is Outcome.NOT_COMPARABLE for table in read)
        outcome = Outcome.NOT_COMPARABLE if timed else Outcome.REPRODUCED
        return line(outcome, f"it shows the table(s) {names}" if read else "its files are intact")


def _claim(name: str, expected: pd.DataFrame, found: pd.DataFrame) -> Line:
    if name not in expected.index or name not in found.index:
        text = "the claim is new" if name in found.index else "the claim is missing"
        return Line("claim", name, Outcome.DIFFERS, text)
    rule = load_claims(Path(RULES)).get(name)
    timed = timed_columns(rule) if rule else set()
    texts, outcomes = [], []
    for column, words in VERDICTS.items():
        a, b = str(expected.loc[name, column]), str(found.loc[name, column])
        changed = f"expected '{a}', found '{b}'" + ", which depends on times" * (column in timed)
        texts.append(f"{words}: {b if a == b else changed}")
        bad = Outcome.NOT_COMPARABLE if column in timed else Outcome.DIFFERS
        outcomes.append(Outcome.REPRODUCED if a == b else bad)
    return Line("claim", name, max(outcomes, key=[*Outcome].index), "; ".join(texts))
