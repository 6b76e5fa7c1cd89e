"""What a finished run says last: configuration, verdicts, files, time."""

import os
import shlex
import time
from collections.abc import Sequence
from pathlib import Path

import psutil

from pdrom.core import paths
from pdrom.core.store import Condition, check_file, read_table
from pdrom.pipeline.commandline import CommandLine
from pdrom.pipeline.folders import Folders

LISTED = 8  # targets, by their names


def processor_seconds() -> float:
    """Processor time of this process and of all that it has started, until now."""
    own = psutil.Process()
    total = 0.0
    for process in (own, *own.children(recursive=True)):
        try:
            times = process.cpu_times()
        except psutil.Error:  # it has ended meanwhile
            continue
        total += times.user + times.system
        total += getattr(times, "children_user", 0.0) + getattr(times, "children_system", 0.0)
    return total


def summary(
    command: CommandLine,
    folders: Folders,
    figures: Sequence[str],
    tables: Sequence[str],
    apart: str = "",
) -> str:
    """Lines about a run that has ended well.

    Parameters
    ----------
    figures, tables : files that the study has when it is complete
    apart : words that tell its verdicts from those of the full study, if it is another one
    """
    wall = time.time() - psutil.Process().create_time()
    lines = [f"configuration: {configuration(command)}"]
    if command.targets:
        more = len(command.targets) - LISTED
        others = [f"and {more} more"] if more > 0 else []
        lines.append(f"made: {', '.join([*command.targets[:LISTED], *others])}")
    else:
        lines += _verdicts(folders, apart)
        lines.append(f"manuscript: {folders.manuscript}")
        for kind, files in (("figures", figures), ("tables", tables)):
            found = sum(Path(file).is_file() for file in files)
            lines.append(f"{kind}: {found} in {folders.results}/{kind}")
        lines.append(f"report: {shlex.join(['./reproduce', '--report', 'report.html'])}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    lines.append(
        f"time: {minutes(wall)} on {cores} cores, {minutes(processor_seconds())} of processor time"
    )
    return "\n".join(f"pdrom: {line}" for line in lines) + "\n"


def minutes(seconds: float) -> str:
    """A time in minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60} s" if whole >= 60 else f"{whole} s"


def configuration(command: CommandLine) -> str:
    """Files and settings of a configuration, in one line."""
    names = command.configfiles or ("config/default.yaml",)
    return ", ".join([*names, *command.settings])


def _verdicts(folders: Folders, apart: str) -> list[str]:
    """All verdicts in one line; none where the table cannot be read."""
    path = paths.TABLE.at(folders.results, name="claims")
    # only looked at: a job sets a damaged one aside
    if not Path(path).is_file() or check_file(path) is not Condition.INTACT:
        return []
    table = read_table(path, ["claim", "verdict", "verdict_beyond"])
    verdicts = [f"{r.claim} {r.verdict} / {r.verdict_beyond}" for r in table.itertuples()]
    words = f"as published / beyond; {apart}" if apart else "as published / beyond"
    return [f"verdicts ({words}): {', '.join(verdicts)}"]
