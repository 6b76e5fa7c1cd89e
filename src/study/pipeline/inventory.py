"""Text of results/contents.md, an overview of a finished study for readers of its results.

It lists every claim, figure, table and section of the text with the command that makes it and its
processor minutes, then the captions of the figures and the columns of the tables.
"""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from study.artifact.logs import usage_of
from study.artifact.paths import FIGURE, RESULTS, TABLE, Place
from study.artifact.reads import Every, ProjectFile, Read, Setting, TableOf
from study.figures.kit.declaration import declarations
from study.paper.figure_numbers import figures_page
from study.paper.macros import keys_of
from study.paper.source import source_files
from study.pipeline.commandline import CommandLine
from study.pipeline.folders import Folders
from study.pipeline.summary import configuration, verdicts_in
from study.pipeline.targets import PREPRINT, own_file
from study.tables import declared
from study.tables.claims.rules import load_claims
from study.tables.kit.declaration import Column, Table

TABLES_HEAD = """# Tables

Tables are CSV with one row per observation, SI units unless a unit says otherwise, and an empty
cell where there is no value.
A column marked "timed" depends on timing or on the memory in use: only there may two runs on one
machine differ (in `claims`, only in claims about times).
"Compared as" is the kind for which `./reproduce verify` has a tolerance, followed by the column's
own tolerance if it has one (docs/verification.md).
"""
CONTENTS = Place("contents.md")
CLAIMS = "claims"
HEAD = """\
# Contents

Written by the run of {configuration}.
Minutes are processor time of all jobs that an entry needs, from nothing; empty where a job was not
measured by this run.

| kind | name | command | jobs | minutes | as published | beyond |
|---|---|---|---|---|---|---|
"""


def document(tables: Iterable[Table]) -> str:
    """Return the Markdown that describes all ``tables`` and their columns."""
    tables = list(tables)
    names = [f"- [{table.name}](#{table.name}): {table.title}" for table in tables]
    parts = [TABLES_HEAD, "\n".join(names) + "\n", *map(_section, tables)]
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
        case Every(place):
            return f"`{place.pattern}`"
        case TableOf(name):
            return f"table [{name}](#{name})"
        case Setting(key):
            return f"setting `{key}`"
        case ProjectFile(path):
            return f"`{path}`"
    raise TypeError(f"{read} has no words")


class Entry(NamedTuple):
    """A line of the overview.

    kind : claim, figure, table, section (source file of the text with numbers) or manuscript
    files : paths of its files in the default configuration
    words : arguments of ./reproduce that make these files
    """

    kind: str
    name: str
    files: tuple[str, ...]
    words: tuple[str, ...]


def entries() -> Iterator[Entry]:
    """Yield the entries of claims, figures, tables, sections and manuscript, in this order."""
    for name in load_claims(Path("config/claims.yaml")):
        yield Entry("claim", name, (TABLE.at(RESULTS, name=CLAIMS),), (CLAIMS,))
    for name, figure in declarations().items():
        number = f"{PREPRINT}{figure.number}" if figure.number else name
        yield Entry("figure", name, (FIGURE.at(RESULTS, name=name),), ("figure", number))
    tables = {name: TABLE.at(RESULTS, name=name) for name in declared()}
    # where a figure has the same name, the name stands for both, so that the table's path is used
    words = {name: path if name in declarations() else name for name, path in tables.items()}
    for name, path in tables.items():
        yield Entry("table", name, (path,), (words[name],))
    for source in source_files(Path()):
        keys = keys_of(Path(source).read_text(encoding="utf-8"))
        if held := sorted({key.partition("|")[0] for key in keys} & tables.keys()):
            files, targets = (tuple(names[name] for name in held) for names in (tables, words))
            yield Entry("section", Path(source).stem, files, targets)
    documents = tuple(Folders().documents.values())
    yield Entry("manuscript", documents[0], documents, ())


def contents(command: CommandLine, dag: Any, folders: Folders) -> str:
    """Text of the overview of a run that has made everything.

    Parameters
    ----------
    command : command line that started the run
    dag : Snakemake's graph of all jobs of the study
    folders : folders of the study's results
    """
    listed, verdicts = list(entries()), verdicts_in(folders.results)
    lines = []
    for entry, (jobs, minutes) in zip(listed, costs(listed, dag, folders), strict=True):
        words = shlex.join(["./reproduce", *entry.words, *command.configuration])
        measured = "" if minutes is None else f"{minutes:.1f}"
        judged = verdicts.get(entry.name, ("", "")) if entry.kind == "claim" else ("", "")
        cells = (entry.kind, entry.name, f"`{words}`", f"{jobs}", measured, *judged)
        lines.append(f"| {' | '.join(cells)} |\n")
    head = HEAD.format(configuration=configuration(command)) + "".join(lines)
    return "\n".join([head, figures_page(Path()), document(declared().values())])


def costs(
    listed: Sequence[Entry], dag: Any, folders: Folders
) -> Iterator[tuple[int, float | None]]:
    """Yield for each entry its number of jobs, with all prerequisites, and their processor minutes.

    The minutes are None if a job was not measured. ``dag`` is Snakemake's graph of jobs.
    """
    makers = {str(file): job for job in dag.jobs for file in job.output}
    used = {job: usage_of(job.log[0]) for job in makers.values()}
    for entry in listed:
        own = {makers[own_file(file, folders)] for file in entry.files}
        needed = [used[job] for job in dag.bfs(dag.dependencies, *own)]
        measured = [usage.processor for usage in needed if usage is not None]
        whole = len(measured) == len(needed)
        yield len(needed), sum(measured) / 60.0 if whole else None
