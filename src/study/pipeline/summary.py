"""Texts about a finished run: the last lines it prints, and the overview results/contents.md.

The overview lists every claim, figure and table, and the manuscript, with the command line that
makes it. The columns of the tables follow.
"""

import shlex
import time
from collections.abc import Iterator
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
from study.tables.claims.rules import load_claims
from study.tables.effects_cost import unreliable
from study.tables.kit.declaration import Table

TABLES_HEAD = """# Tables

Tables are CSV with one row per observation, SI units unless a unit says otherwise, and an empty
cell where there is no value.
A column marked "timed" depends on timing or on the memory in use: only there may two runs on one
machine differ (in `claims`, only in claims about times).
"Compared as" is the kind for which `./reproduce verify` has a tolerance, followed by the column's
own tolerance if it has one (docs/verification.md).
"""
CONTENTS = paths.Place("contents.md")
HEAD = """\
# Contents

Written by the run of {configuration}.
With `-n`, a command says how many jobs and minutes an entry needs.

| kind | name | command | as published | beyond |
|---|---|---|---|---|
"""


def processor_seconds() -> float:
    """Processor seconds used until now by this process and its child processes."""
    own, total = psutil.Process(), 0.0
    for process in (own, *own.children(recursive=True)):
        with suppress(psutil.Error):  # the child may have ended since the list was made
            total += sum(process.cpu_times()[:4])  # also of its ended child processes
    return total


def summary(command: CommandLine, plan: Plan) -> str:
    """Return the last lines that a successful run prints, from its command line and its plan."""
    folders, apart = plan.folders, plan.study.apart
    wall = time.time() - psutil.Process().create_time()
    lines = [f"configuration: {configuration(command)}"]
    if command.targets:
        lines.append(f"made: {', '.join(command.targets)}")
    else:
        if "claims" in plan.tables and (verdicts := verdicts_in(folders.results)):
            words = f"as published / beyond; {apart}" if apart else "as published / beyond"
            said = [f"{claim} {' / '.join(pair)}" for claim, pair in verdicts.items()]
            lines.append(f"verdicts ({words}): {', '.join(said)}")
        lines.append(f"manuscript: {', '.join(folders.documents.values())}")
        lines.append(f"as pages: {paths.ARTICLE.at(folders.results, name='index.html')}")
        for kind in ("figures", "tables"):
            lines.append(f"{kind}: {len(plan.fixed[kind])} in {folders.results}/{kind}")
        if absent := plan.absent:
            lines.append(absent)
        lines.append("report: ./reproduce --report report.html")
    cores, used = available_cpu_count(), processor_seconds()
    lines.append(f"time: {minutes(wall)} on {cores} cores, {minutes(used)} of processor time")
    times = Path(paths.TABLE.at(folders.results, name="frame_times"))
    if times.is_file() and check_file(times) is Condition.INTACT and unreliable(read_table(times)):
        lines.append(
            "times: unreliable, other programs used the processor; none is in the manuscript"
        )
    return "\n".join(f"pdrom: {line}" for line in lines) + "\n"


def minutes(seconds: float) -> str:
    """Duration of ``seconds`` as text in minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60} s" if whole >= 60 else f"{whole} s"


def configuration(command: CommandLine) -> str:
    """Names of the configuration files and settings of ``command``, in one line."""
    names = command.configfiles or ("config/default.yaml",)
    return ", ".join([*names, *command.settings])


def verdicts_in(results: str) -> dict[str, tuple[str, str]]:
    """Claim -> verdicts on the preprint's and on improved methods; {} if that table is damaged."""
    path = paths.TABLE.at(results, name="claims")
    # a damaged file is only ignored here: the next job that reads it renames it
    if not Path(path).is_file() or check_file(path) is not Condition.INTACT:
        return {}
    table = read_table(path, ["claim", "verdict", "verdict_beyond"])
    return {row.claim: (row.verdict, row.verdict_beyond) for row in table.itertuples()}


def _section(table: Table) -> str:
    """Markdown text that describes a table and its columns."""
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


def entries(plan: Plan) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield kind, name and words for ``./reproduce`` of claims, figures, tables, the manuscript."""
    for name in load_claims(Path("config/claims.yaml")) if "claims" in plan.tables else ():
        yield "claim", name, ("claims",)
    for name, figure in plan.figures.items():
        yield "figure", name, ("figure", f"{PREPRINT}{figure.number}" if figure.number else name)
    for name in plan.tables:
        # a name that a table and a figure share would request both: request this table by its path
        path = paths.TABLE.at(paths.RESULTS, name=name)
        yield "table", name, (path if name in declarations() else name,)
    yield "manuscript", Folders().manuscript, ()


def contents(command: CommandLine, plan: Plan) -> str:
    """Return the text of results/contents.md after the run of ``command`` made all results."""
    verdicts, lines = verdicts_in(plan.results), []
    for kind, name, words in entries(plan):
        line = shlex.join(["./reproduce", *words, *command.configuration])
        judged = verdicts.get(name, ("", "")) if kind == "claim" else ("", "")
        lines.append(f"| {' | '.join((kind, name, f'`{line}`', *judged))} |\n")
    head = HEAD.format(configuration=configuration(command)) + "".join(lines)
    tables = plan.tables.values()
    names = "\n".join(f"- [{table.name}](#{table.name}): {table.title}" for table in tables)
    described = [TABLES_HEAD, f"{names}\n", *map(_section, tables)]
    return "\n".join([head, *described])
