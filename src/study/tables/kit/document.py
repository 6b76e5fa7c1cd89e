"""The list of tables for a reader: every table with what it reads and every column."""

from collections.abc import Iterable

from study.artifact.reads import Every, PerScene, Preferred, ProjectFile, Read, Setting, TableOf
from study.tables.kit.declaration import Column, Table

HEAD = """# Tables

Tables are CSV with one row per observation, SI units unless a unit says otherwise, and an empty
cell where there is no value.
A column marked "timed" depends on timing or on the memory in use: only there may two runs on one
machine differ (in `claims`, only in claims about times).
"Compared as" is the kind for which `./reproduce verify` has a tolerance, followed by the column's
own tolerance if it has one (docs/verification.md).
"""


def document(tables: Iterable[Table]) -> str:
    """Markdown of all tables."""
    tables = list(tables)
    names = [f"- [{table.name}](#{table.name}): {table.title}" for table in tables]
    parts = [HEAD, "\n".join(names) + "\n", *map(_section, tables)]
    return "\n".join(parts)


def _section(table: Table) -> str:
    sources = dict.fromkeys(_source(read) for read in table.reads.values())
    lines = [
        f"## {table.name}",
        "",
        f"{table.title}.\nMade by `{table.module}` from {', '.join(sources)}.",
        "",
        "| column | type | unit | timed | compared as | meaning |",
        "|---|---|---|---|---|---|",
        *map(_row, table.columns),
    ]
    return "\n".join(lines) + "\n"


def _row(column: Column) -> str:
    timed = "timed" if column.timed else ""
    own = "" if column.tolerance is None else f", {column.tolerance:g}"
    kind = f"{column.quantity}{own}"
    cells = (column.name, column.kind, column.unit, timed, kind, column.meaning)
    return f"| {' | '.join(cells)} |"


def _source(read: Read) -> str:
    match read:
        case Every(place) | Preferred(place):
            return f"`{place.pattern}`"
        case TableOf(name):
            return f"table [{name}](#{name})"
        case Setting(key):
            return f"setting `{key}`"
        case PerScene(key):
            return f"`{key}` of every scene"
        case ProjectFile(path):
            return f"`{path}`"
    raise TypeError(f"{read} has no words")
