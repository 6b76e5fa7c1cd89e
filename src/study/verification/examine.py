"""Comparison of the claims, figures and tables of a results folder with the expected ones."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import Condition, check_file, read_table
from study.artifact.paths import TABLE
from study.pipeline.plan import Job
from study.pipeline.unfit import UNUSUAL, faults
from study.tables import declared
from study.tables.claims.rules import load_claims
from study.verification import compare
from study.verification.files import is_derived, made
from study.verification.references import Reference, folder_of, read_references
from study.verification.subject import Subject

RULES = Path("config/claims.yaml")
CLAIMS = "claims"
# Verdict column of table claims -> field of `ClaimRule` with its tests, its name in messages.
PARTS = {"verdict": ("published", "as published"), "verdict_beyond": ("beyond", "beyond")}


class Outcome(StrEnum):
    """Result of comparing a claim, figure or table of a run with the expected one in git."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    NOT_COMPARABLE = "not comparable on this machine"
    NO_REFERENCE = "no reference"
    MISSING = "not there"


class Line(NamedTuple):
    """Outcome of comparing one claim, figure or table with the expected one.

    kind : claim, figure, table, or file: a result that does not fit the plan
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
    """Comparison of the results of a configuration with the expected ones.

    Three attributes are functions with cached return values:

    condition : returns the `Condition` of the file at a path, None if the file is missing
    read : returns the table of a name, as read from its file
    again : returns the table of a name, computed again from other tables (see `_again`)
    """

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.condition = cache(lambda path: check_file(path) if Path(path).is_file() else None)
        self.read, self.again = cache(self._read), cache(self._again)

    def lines(self) -> list[Line]:
        """Outcomes of claims, figures, tables; "differs" for a CSV file that is no such table."""
        tables = {name: self.table(name) for name in declared()}
        figures = [self._figure(job, tables) for job in self.subject.plan.fixed["figures"]]
        folder = Path(TABLE.at(self.subject.results, name="any")).parent
        strangers = [
            Line("table", path.stem, Outcome.DIFFERS, f"{path} is no table of the study")
            for path in sorted(folder.glob("*.csv"))
            if path.stem not in declared() and path.name[0] != "."
        ]
        unfit = [
            Line("file", path, Outcome.MISSING, f"{fault}; run {self.subject.command()}")
            for path, fault in faults(self.subject.plan).items()
            if fault in UNUSUAL
        ]
        return [*self.claims(), *figures, *tables.values(), *strangers, *unfit]

    def found(self, name: str) -> pd.DataFrame:
        """Return table ``name`` of the results folder with all declared columns.

        Raises StorageError if its file is missing or damaged, or has columns not declared.
        """
        return declared()[name].checked(self.read(name))

    def _read(self, name: str) -> pd.DataFrame:
        path, columns = TABLE.at(self.subject.results, name=name), declared()[name].column_names
        if self.condition(path) is not Condition.INTACT:
            raise StorageError(f"{path}: not there, or damaged")
        other = sorted(set(read_table(path).columns) - set(columns))
        if other:
            raise StorageError(f"{path}: has the unknown column(s) {', '.join(other)}")
        return read_table(path, columns)

    @cached_property
    def expected(self) -> dict[str, Reference]:
        """Name of a table -> expected table, for each table that has one."""
        return read_references(folder_of(self.subject.results))

    @cached_property
    def context(self) -> compare.Context:
        """Properties of scenes and runs: they show which table rows depend on rounding errors."""
        tables = {name: reference.frame for name, reference in self.expected.items()}
        try:
            return compare.Context(tables, self.found(compare.RUNS))
        except StorageError:
            return compare.Context(tables)

    def _again(self, name: str) -> pd.DataFrame | None:
        """Return the table ``name``, computed again from the existing tables that it reads.

        Return None if the table reads other files, too, or if an input is missing or damaged.
        """
        if not is_derived(name):
            return None
        job = self.subject.plan.job(declared()[name])
        if any(self.condition(path) is not Condition.INTACT for path in _results(job.files)):
            return None
        with made(job) as files:
            return read_table(files[job.outputs["table"]])

    def table(self, name: str) -> Line:
        """Compare the table ``name`` with the expected one and return the outcome."""

        def line(outcome: Outcome, text: str, *details: str) -> Line:
            return Line("table", name, outcome, text, details)

        missing = self._missing("table", name, [TABLE.at(self.subject.results, name=name)])
        if missing is not None:
            return missing
        if name not in self.expected:
            return line(Outcome.NO_REFERENCE, "run verify --update")
        table, reference = declared()[name], self.expected[name]
        try:
            frame, again = self.found(name), self.again(name)
        except StorageError as error:
            return line(Outcome.DIFFERS, str(error))
        other = None if again is None else _first_difference(self.read(name), again)
        if other is not None:
            return line(Outcome.DIFFERS, f"not what the tables at hand give, {other}")
        lacking = set(frame.columns) - set(reference.columns)
        known = table.checked(frame.assign(**dict.fromkeys(lacking, None)))
        differences, compared = compare.judge(
            compare.Comparison(table, reference.frame, known, self.context)
        )
        if differences:
            more = f" and {len(differences) - 1} more" if differences[1:] else ""
            return line(Outcome.DIFFERS, differences[0] + more, *differences)
        columns = compare.kept(table)
        if new := sorted(lacking & set(columns)):
            return line(Outcome.NO_REFERENCE, f"column(s) {', '.join(new)}: run verify --update")
        if all(map(compare.names_row, columns.values())):
            text = "its numbers are times or round-off; names and sizes agree"
            return line(Outcome.NOT_COMPARABLE, text)
        return line(Outcome.REPRODUCED, compared)

    def claims(self) -> list[Line]:
        """Outcome of each claim: whether its verdicts equal those of the expected table."""
        line = self.table(CLAIMS)
        try:
            found = self.found(CLAIMS).set_index("claim")
            expected = self.expected[CLAIMS].frame.set_index("claim")
            again = self.again(CLAIMS)
        except (KeyError, StorageError):
            return [Line("claim", "all", line.outcome, line.text)]
        decided = found if again is None else again.set_index("claim")
        if not found.index.is_unique:
            return [Line("claim", "all", line.outcome, line.text)]
        names = dict.fromkeys([*expected.index, *found.index])
        return [_claim(str(name), expected, found, decided) for name in names]

    def _missing(self, kind: str, name: str, paths: list[str]) -> Line | None:
        for path in paths:
            condition = self.condition(path)
            if condition is not Condition.INTACT:
                fault = "not there" if condition is None else condition
                text = f"{path} is {fault}; make it by {self.subject.command(name)}"
                return Line(kind, name, Outcome.MISSING, text)
        return None

    def _figure(self, figure: Job, tables: Mapping[str, Line]) -> Line:
        name = figure.artifact.name
        missing = self._missing("figure", name, list(figure.outputs.values()))
        if missing is not None:
            return missing
        paths = {TABLE.at(self.subject.results, name=table): table for table in declared()}
        read = [paths[path] for path in figure.files if path in paths]
        bad = [tables[table] for table in read if tables[table].outcome not in GOOD]
        if bad:
            text = f"reads the table(s) {', '.join(line.name for line in bad)}"
            return Line("figure", name, bad[0].outcome, text)
        files = [path for path in _results(figure.files) if path not in paths]
        for path in files:
            if self.condition(path) is not Condition.INTACT:
                text = f"{path}, which it reads, is not there or damaged"
                return Line("figure", name, Outcome.MISSING, text)
        text = f"by the table(s) {', '.join(read)}" if read else "its files are there and intact"
        if read and all(tables[t].outcome is Outcome.NOT_COMPARABLE for t in read):
            return Line("figure", name, Outcome.NOT_COMPARABLE, f"{text}, which hold times")
        more = f" and {len(files)} intact files" if read and files else ""
        return Line("figure", name, Outcome.REPRODUCED, text + more)


def _claim(name: str, expected: pd.DataFrame, found: pd.DataFrame, decided: pd.DataFrame) -> Line:
    """Compare the verdicts on claim ``name`` in the expected, found and recomputed table claims."""
    if name not in expected.index or name not in found.index:
        text = "the claim is new" if name in found.index else "the claim is gone"
        return Line("claim", name, Outcome.DIFFERS, text)
    parts = []
    for column, (part, words) in PARTS.items():
        a, b, c = (str(frame.loc[name, column]) for frame in (expected, found, decided))
        outcome, text = Outcome.REPRODUCED, b
        if b != c:
            outcome, text = Outcome.DIFFERS, f"found '{b}', the tables at hand give '{c}'"
        elif a != b:
            outcome, text = Outcome.DIFFERS, f"expected '{a}', found '{b}'"
            tests = getattr(load_claims(RULES).get(name), part, ())
            if any(test.decides and test.timed for test in tests):
                outcome, text = Outcome.NOT_COMPARABLE, f"{text}, which rests on times"
        parts.append((outcome, f"{words}: {text}"))
    ranks = (Outcome.DIFFERS, Outcome.NOT_COMPARABLE, Outcome.REPRODUCED)
    worst = min((outcome for outcome, _ in parts), key=ranks.index)
    changed = [text for outcome, text in parts if outcome is not Outcome.REPRODUCED]
    return Line("claim", name, worst, "; ".join(changed or [text for _, text in parts]))


def _results(paths: Sequence[str]) -> list[str]:
    return [path for path in paths if path.startswith("results/")]


def _first_difference(found: pd.DataFrame, again: pd.DataFrame) -> str | None:
    """Text on the first cell that differs in two tables, or on unequal sizes; None if all agree."""
    if list(found.columns) != list(again.columns) or len(found) != len(again):
        return f"which have {len(again)} rows of {len(again.columns)} columns"
    other = (found != again) & ~(found.isna() & again.isna())
    places = np.argwhere(other.to_numpy())
    if not len(places):
        return None
    row, column = places[0]
    old, new = (compare.in_words(frame.iloc[row, column]) for frame in (found, again))
    return f"as in row {row + 1} {found.columns[column]}: found {old}, they give {new}"
