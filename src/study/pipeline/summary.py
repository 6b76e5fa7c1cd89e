"""Describe a finished run: the last lines that it prints, and the overview results/contents.md.

The overview lists all figures, tables and the manuscript with the commands that make them, and
describes all columns of the tables.
"""

import shlex
import time
from contextlib import suppress
from pathlib import Path

import psutil
from snakemake.utils import available_cpu_count

from pdrom.core.store import Condition, check_file, read_table
from study.artifact import paths
from study.figures.kit.declaration import declarations
from study.pipeline.commandline import CommandLine
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.targets import PREPRINT
from study.tables.kit.declaration import Table

HEAD = """\
# Contents

Written by the run of {configuration}.
Add `-n` to a command to see how many jobs and minutes it would take.

| kind | name | command |
|---|---|---|
{entries}
# Tables

Tables are CSV files with one row for each observation. An empty cell has no value. Units are SI
units unless the column "unit" says otherwise.
Two runs on one machine can differ only in columns marked "timed", which depend on measured times
or on the memory in use (in the table `claims`, only in claims about times).
"Compared as" is the kind by which `./reproduce verify` compares the cells, and the tolerance of
the column if it is not that of the kind (docs/verification.md).
"""
CONTENTS = paths.Place("contents.md")


def processor_seconds() -> float:
    """Return the processor seconds that this process and its child processes have used so far."""
    own, total = psutil.Process(), 0.0
    for process in (own, *own.children(recursive=True)):
        with suppress(psutil.Error):  # the child may have ended since the list was made
            total += sum(process.cpu_times()[:4])  # includes times of its ended child processes
    return total


def summary(command: CommandLine, plan: Plan) -> str:
    """Return the last lines that a successful run prints, from its command line and its plan."""
    folders = plan.folders
    wall = time.time() - psutil.Process().create_time()
    lines = [f"configuration: {configuration(command)}"]
    if command.targets:
        lines.append(f"made: {', '.join(command.targets)}")
    else:
        claims = paths.TABLE.at(folders.results, name="claims")
        # leave out a damaged file: the next run makes it again
        if Path(claims).is_file() and check_file(claims) is Condition.INTACT:
            rows = read_table(claims).itertuples()
            said = [f"{row.claim} {row.verdict} / {row.verdict_beyond}" for row in rows]
            lines.append(f"verdicts (as published / improved): {', '.join(said)}")
        lines.append(f"manuscript: {', '.join(folders.documents.values())}")
        lines.append(f"web pages: {paths.ARTICLE.at(folders.results, name='index.html')}")
        for kind in ("figures", "tables"):
            lines.append(f"{kind}: {len(plan.fixed[kind])} in {folders.results}/{kind}")
        if absent := plan.absent:
            lines.append(absent)
        lines.append("report: ./reproduce --report report.html")
    cores, used = available_cpu_count(), processor_seconds()
    lines.append(f"time: {minutes(wall)} on {cores} cores, {minutes(used)} of processor time")
    return "\n".join(f"pdrom: {line}" for line in lines) + "\n"


def minutes(seconds: float) -> str:
    """Return the duration ``seconds`` as text in minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60} s" if whole >= 60 else f"{whole} s"


def configuration(command: CommandLine) -> str:
    """Return the configuration files and settings of ``command`` in one line."""
    names = command.configfiles or ("config/default.yaml",)
    return ", ".join([*names, *command.settings])


def _section(table: Table) -> str:
    """Describe a table and its columns in Markdown."""
    lines = [
        f"## {table.name}",
        "",
        f"{table.title}.\nMade by `{table.function.__module__}`.",
        "",
        "| column | type | unit | timed | compared as | meaning |",
        "|---|---|---|---|---|---|",
    ]
    for column in table.columns:
        timed = "timed" if column.timed else ""
        own = "" if column.tolerance is None else f", {column.tolerance:g}"
        kind = f"{column.quantity}{own}"
        cells = (column.name, column.kind, column.unit, timed, kind, column.meaning)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def contents(command: CommandLine, plan: Plan) -> str:
    """Return the text of results/contents.md after the run of ``command`` made all results."""
    entries: list[tuple[str, str, tuple[str, ...]]] = [
        ("figure", name, ("figure", f"{PREPRINT}{figure.number}" if figure.number else name))
        for name, figure in plan.figures.items()
    ]
    for name in plan.tables:
        # if a figure has the name of this table, the name would request both: give the path
        path = paths.TABLE.at(paths.RESULTS, name=name)
        entries.append(("table", name, (path if name in declarations() else name,)))
    entries.append(("manuscript", Folders().manuscript, ()))
    lines = [
        f"| {kind} | {name} | `{shlex.join(['./reproduce', *words, *command.configuration])}` |\n"
        for kind, name, words in entries
    ]
    head = HEAD.format(configuration=configuration(command), entries="".join(lines))
    return "\n".join([head, *map(_section, plan.tables.values())])
