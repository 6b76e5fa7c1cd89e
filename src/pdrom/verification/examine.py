"""Lines about claims, figures and tables of a results folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import pandas as pd

from pdrom.core.paths import TABLE
from pdrom.core.store import Condition, check_file, read_table
from pdrom.pipeline.figures import FigureJob
from pdrom.pipeline.tables import all_tables
from pdrom.report.claims import load_claims
from pdrom.verification.judge import Judgement, judge
from pdrom.verification.lines import Line, Outcome, table_line
from pdrom.verification.references import Reference, folder_of, kept, read_reference
from pdrom.verification.rows import PARTS
from pdrom.verification.settings import RULES
from pdrom.verification.spread import COMPARED, comparisons
from pdrom.verification.subject import Subject
from pdrom.verification.times import changed_by_times
from pdrom.verification.tolerances import Tolerances

CLAIMS = "claims"
MEASURED = (*COMPARED, "verdict")
WORDS = {"published": "as published", "beyond": "beyond"}


@dataclass
class Examination:
    """What is there, what is expected, and what differs.

    anew : share of the rows of a table whose samples may have been chosen anew
    """

    subject: Subject
    tolerances: Tolerances
    anew: float
    conditions: dict[str, Condition | None] = field(default_factory=dict)

    def lines(self) -> list[Line]:
        """Lines of all claims, figures and tables."""
        tables = [self._table(name) for name in all_tables()]
        return [*self._claims(), *self._figures(tables), *tables]

    def condition(self, path: str) -> Condition | None:
        """Condition of a file, None if it is not there."""
        if path not in self.conditions:
            there = Path(path).is_file()
            self.conditions[path] = check_file(path) if there else None
        return self.conditions[path]

    @cached_property
    def found(self) -> dict[str, pd.DataFrame]:
        """Tables that are there and intact, by name."""
        paths = {name: TABLE.at(self.subject.results, name=name) for name in all_tables()}
        return {
            name: table.checked(read_table(paths[name]))
            for name, table in all_tables().items()
            if self.condition(paths[name]) is Condition.INTACT
        }

    @cached_property
    def expected(self) -> dict[str, Reference]:
        """Expected tables that there are, by name."""
        folder = folder_of(self.subject.results)
        read = {name: read_reference(table, folder) for name, table in all_tables().items()}
        return {name: reference for name, reference in read.items() if reference is not None}

    @cached_property
    def judgements(self) -> Mapping[str, Judgement]:
        """Judgements on tables that are there and expected."""
        frames = {name: reference.frame for name, reference in self.expected.items()}
        found = {name: self._known(name, frame) for name, frame in self.found.items()}
        compared = comparisons(all_tables(), frames, found, self.on_times)
        return {name: judge(c, self.tolerances, self.anew) for name, c in compared.items()}

    @cached_property
    def on_times(self) -> Mapping[tuple[str, str], str]:
        """Why a changed verdict says nothing, by claim and part."""
        if CLAIMS not in self.found or CLAIMS not in self.expected:
            return {}
        frames = {name: reference.frame for name, reference in self.expected.items()}
        rules = load_claims(RULES)
        return changed_by_times(rules, frames, self.found, self.tolerances)

    def _known(self, name: str, frame: pd.DataFrame) -> pd.DataFrame:
        """A table with columns emptied that its reference does not have."""
        if name not in self.expected:
            return frame
        lacking = set(frame.columns) - set(self.expected[name].columns)
        return all_tables()[name].checked(frame.assign(**dict.fromkeys(lacking, None)))

    def _table(self, name: str) -> Line:
        missing = self._missing("table", name, [TABLE.at(self.subject.results, name=name)])
        if missing is not None:
            return missing
        if name not in self.expected:
            return Line("table", name, Outcome.NO_REFERENCE, "run verify --update")
        table = all_tables()[name]
        lacking = set(kept(table)) - set(self.expected[name].columns)
        measured = any(column.quantity in MEASURED for column in table.columns)
        return table_line(self.judgements[name], measured, sorted(lacking))

    def _missing(self, kind: str, name: str, paths: list[str]) -> Line | None:
        for path in paths:
            condition = self.condition(path)
            if condition is not Condition.INTACT:
                fault = "not there" if condition is None else condition
                text = f"{path} is {fault}; make it by {self.subject.command(name)}"
                return Line(kind, name, Outcome.MISSING, text)
        return None

    def _claims(self) -> list[Line]:
        if CLAIMS not in self.found or CLAIMS not in self.expected:
            missing = self._table(CLAIMS)
            return [Line("claim", "all", missing.outcome, missing.text)]
        expected = self.expected[CLAIMS].frame.set_index("claim")
        found = self.found[CLAIMS].set_index("claim")
        names = dict.fromkeys([*expected.index, *found.index])
        return [self._claim(str(name), expected, found) for name in names]

    def _claim(self, name: str, expected: pd.DataFrame, found: pd.DataFrame) -> Line:
        if name not in expected.index or name not in found.index:
            text = "the claim is new" if name in found.index else "the claim is gone"
            return Line("claim", name, Outcome.DIFFERS, text)
        outcome, same, changed = Outcome.REPRODUCED, [], []
        for column, part in PARTS.items():
            a, b = (str(frame.loc[name, column]) for frame in (expected, found))
            if a == b:
                same.append(f"{WORDS[part]}: {b}")
                continue
            text, why = (
                f"{WORDS[part]}: expected '{a}', found '{b}'",
                self.on_times.get((name, part)),
            )
            changed.append(text if why is None else f"{text}, which {why}")
            if outcome is not Outcome.DIFFERS:
                outcome = Outcome.DIFFERS if why is None else Outcome.NOT_COMPARABLE
        return Line("claim", name, outcome, "; ".join(changed or same))

    def _figures(self, tables: list[Line]) -> list[Line]:
        by_name = {line.name: line for line in tables}
        return [
            self._figure(name, job, by_name) for name, job in self.subject.plan.figure_jobs.items()
        ]

    def _figure(self, name: str, job: FigureJob, tables: Mapping[str, Line]) -> Line:
        missing = self._missing("figure", name, [job.pdf, job.png])
        if missing is not None:
            return missing
        paths = {TABLE.at(self.subject.results, name=table): table for table in tables}
        read = [paths[path] for path in job.inputs if path in paths]
        bad = [
            tables[table]
            for table in read
            if tables[table].outcome not in (Outcome.REPRODUCED, Outcome.NOT_COMPARABLE)
        ]
        if bad:
            text = f"reads the table(s) {', '.join(line.name for line in bad)}"
            return Line("figure", name, bad[0].outcome, text)
        files = [path for path in job.inputs if path not in paths and path.startswith("results/")]
        for path in files:
            if self.condition(path) is not Condition.INTACT:
                text = f"{path}, which it reads, is not there or damaged"
                return Line("figure", name, Outcome.MISSING, text)
        text = f"by the table(s) {', '.join(read)}" if read else "its files are there and intact"
        if read and all(tables[t].outcome is Outcome.NOT_COMPARABLE for t in read):
            return Line("figure", name, Outcome.NOT_COMPARABLE, f"{text}, which hold times")
        more = f" and {len(files)} intact files" if read and files else ""
        return Line("figure", name, Outcome.REPRODUCED, text + more)
