"""Comparison of two studies: what agrees, what differs beyond tolerance, what one side alone has.

A counts as the expected one: tolerances, rows that belong together and rows that rounding decides
about are those of ``./reproduce verify``.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import pandas as pd

from pdrom.artifact.reads import Every, TableOf
from pdrom.core.errors import StorageError
from pdrom.core.paths import FIGURE_PICTURE
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.tables import declared
from pdrom.tables.kit.declaration import Column, Table
from pdrom.verification.compare import Comparison
from pdrom.verification.examine import CLAIMS, PARTS, claim_line
from pdrom.verification.judge import Judgement, judge, row_in_words
from pdrom.verification.lines import Line, Outcome, table_line
from pdrom.verification.pairing import names_row
from pdrom.verification.rows import RECONSTRUCTION, RUNS, SPECTRA, Context
from pdrom.verification.studies.sides import Side


@dataclass
class Findings:
    """Findings about two studies.

    comparisons : of each table that both have, the rows that belong together
    left : of each table, what is on one side only
    claims : of each claim, what it says
    """

    a: Side
    b: Side
    comparisons: dict[str, Comparison] = field(default_factory=dict)
    left: dict[str, list[str]] = field(default_factory=dict)
    claims: dict[str, str] = field(default_factory=dict)

    def lines(self) -> list[Line]:
        """Lines of claims, tables and figures."""
        tables = {line.name: line for line in self._tables()}
        return [*self._claims(), *tables.values(), *self._figures(tables)]

    @property
    def alike(self) -> bool:
        """Whether equal settings and code made both, so that each row has to be on both sides."""
        a, b = ({n: (m.settings, m.code) for n, m in s.made.items()} for s in (self.a, self.b))
        return a == b

    def _claims(self) -> Iterator[Line]:
        frames = [s.tables.get(CLAIMS, pd.DataFrame()) for s in (self.a, self.b)]
        if any({"claim", "paper", *PARTS} - {*frame} for frame in frames):
            return
        old, new = (frame.set_index("claim") for frame in frames)
        for name in map(str, dict.fromkeys([*old.index, *new.index])):
            self.claims[name] = str((new if name in new.index else old).paper[name])
            one_sided = _one_sided("claim", name, name in old.index, name in new.index)
            yield one_sided or claim_line(name, old, new, new)

    def _tables(self) -> Iterator[Line]:
        a, b = self.a.tables, self.b.tables
        whole = _whole(a)
        context = Context.of(whole, _whole(b).get(RUNS) if RUNS in whole else None)
        for name in dict.fromkeys([*declared(), *a, *b]):
            if name in a and name in b and name not in declared():
                yield Line("table", name, Outcome.NOT_COMPARABLE, "unknown to this version")
            elif name in a and name in b:
                try:
                    yield self._table(declared()[name], a[name], b[name], context)
                except (StorageError, LookupError) as error:  # cells or columns of another version
                    yield Line("table", name, Outcome.NOT_COMPARABLE, str(error))
            elif line := _one_sided("table", name, name in a, name in b):
                yield line

    def _table(self, table: Table, a: pd.DataFrame, b: pd.DataFrame, context: Context) -> Line:
        common = replace(table, columns=tuple(c for c in table.columns if {c.name} <= {*a} & {*b}))
        first, second = common.checked(a), common.checked(b)
        left = self.left[table.name] = []
        for side, more in (("A", {*a} - {*b}), ("B", {*b} - {*a})):
            left += [f"column(s) of {side} only: {', '.join(sorted(more))}"] if more else []
        if left:
            first, second = _told_apart(common, first, second)
            lost = len(a) + len(b) - len(first) - len(second)
            left += [f"{lost} rows that the common columns do not tell apart"] if lost else []
        compared = self.comparisons[table.name] = Comparison(common, first, second, context)
        judgement = judge(compared) if self.alike else self._judged(compared, left)
        return table_line(judgement, any(not names_row(c) for c in compared.columns()))

    def _judged(self, compared: Comparison, left: list[str]) -> Judgement:
        """Judgement on the rows that both have; those of one side are named in ``left``."""
        table, context = compared.table, compared.context
        judgement = judge(Comparison(table, compared.e, compared.f, context))
        # an outcome that names a row, as a flag does, may be all that differs
        tipped = replace(table, columns=tuple(map(_as_outcome, table.columns)))
        rest = Comparison(tipped, *compared.unpaired(), context)
        for side, rows in zip("AB", rest.unpaired(), strict=True):
            if len(rows):
                left.append(f"{len(rows)} rows of {side} only, as {row_in_words(table, rows, 0)}")
        more = judge(Comparison(tipped, rest.e, rest.f, context))
        return replace(judgement, differences=judgement.differences + more.differences)

    def _figures(self, tables: Mapping[str, Line]) -> Iterator[Line]:
        sides = self.a, self.b
        for name, figure in declarations().items():
            picture = FIGURE_PICTURE.at("", name=name)[1:]
            pictures = [s.made[picture].digest if picture in s.made else "" for s in sides]
            if not all(pictures):
                yield from filter(None, [_one_sided("figure", name, *map(bool, pictures))])
                continue
            names = [r.name for r in figure.reads.values() if isinstance(r, TableOf)]
            read = {n: tables[n].outcome if n in tables else Outcome.MISSING for n in names}
            bad = [n for n, outcome in read.items() if outcome is Outcome.DIFFERS]
            places = [r.place for r in figure.reads.values() if isinstance(r, Every)]
            raw = [{n: s.made[n].digest for p in places for n in s.names(p)} for s in sides]
            outcome, text = Outcome.REPRODUCED, ""
            if bad:
                outcome, text = Outcome.DIFFERS, f"reads the table(s) {', '.join(bad)}"
            elif pictures[0] != pictures[1] and raw[0] != raw[1]:
                outcome, text = Outcome.NOT_COMPARABLE, "drawn from results with other bytes"
            elif read and Outcome.REPRODUCED not in read.values():
                outcome, text = Outcome.NOT_COMPARABLE, "its tables are not judged"
            yield Line("figure", name, outcome, text)


def _one_sided(kind: str, name: str, in_a: bool, in_b: bool) -> Line | None:
    if in_a == in_b:
        return None
    return Line(kind, name, Outcome.MISSING, f"in {'B' if in_a else 'A'}")


def _whole(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Tables that say something about rows of others, where they have all columns of today."""
    found = {}
    for name in tables.keys() & {RUNS, SPECTRA, RECONSTRUCTION}:
        with suppress(StorageError):
            found[name] = declared()[name].checked(tables[name])
    return found


def _told_apart(
    table: Table, a: pd.DataFrame, b: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows that no other row has the names of: a column of one side may have told them apart."""
    counts = [c.name for c in table.columns if c.quantity == "value" and c.kind == "integer"]
    named = [*counts, *(c.name for c in table.columns if names_row(c))]
    keys = [pd.Series([*map(tuple, f[named].astype(str).to_numpy())], f.index) for f in (a, b)]
    twice = {key for side in keys for key in side[side.duplicated()]}
    a, b = (f[~k.isin(twice)].reset_index(drop=True) for f, k in zip((a, b), keys, strict=True))
    return a, b


def _as_outcome(column: Column) -> Column:
    tips = names_row(column) and (column.kind == "flag" or column.name == "horizon_frame")
    return replace(column, declared="error") if tips else column
