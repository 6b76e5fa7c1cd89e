"""Costs of each entry of the claim map, as measured by a run: claim_map.csv and contents.md."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.machine import Machine
from pdrom.core.store import Condition, check_file, read_table, write_table, write_text
from study.artifact.paths import MACHINE, RESULTS, TABLE, Place
from study.artifact.usage import MB, Usage, usage_of
from study.pipeline.commandline import CommandLine, recall
from study.pipeline.folders import DEFAULT, Folders
from study.pipeline.plan import Plan
from study.verification.claim_map.entries import Entry, entries
from study.verification.claim_map.pages import contents

MAP, CONTENTS = Place("claim_map.csv"), Place("contents.md")
COLUMNS = (
    "kind", "name", "rule", "target", "command", "jobs", "minutes", "minutes_alone", "memory",
    "disk", "verdict", "verdict_beyond", "configuration", "machine",
)  # fmt: skip


def write_after(command: CommandLine, dag: Any, plan: Plan, folders: Folders) -> None:
    """Write the map of a run that has made everything; one with targets leaves it as it is.

    Parameters
    ----------
    command : line that started the run
    dag, plan, folders : see `claim_map`
    """
    if not command.targets:
        configuration = " ".join([*command.configfiles, *command.settings]) or DEFAULT
        made = claim_map(dag, plan, folders, options=recall(), configuration=configuration)
        write_table(made, MAP.at(folders.results))
        write_text(contents(made, plan.root), CONTENTS.at(folders.results))


def claim_map(
    dag: Any, plan: Plan, folders: Folders, options: Sequence[str], configuration: str
) -> pd.DataFrame:
    """One row per entry.

    ``jobs`` counts all that it needs from nothing, ``minutes`` is their processor time,
    ``minutes_alone`` that of its own jobs, ``memory`` (MB) the largest of one of them, ``disk``
    (MB) what they write. A cell is empty where a job was not measured.

    Parameters
    ----------
    plan, folders : of the study
    dag : Snakemake's graph of all jobs of the study
    options : those of the command line that name the configuration
    configuration : the same in words
    """
    makers = {str(file): job for job in dag.jobs for file in job.output}
    used = {job: usage_of(job.log[0]) for job in makers.values()}
    verdicts, machine = _verdicts(folders.results), _machine(folders.results)
    rows = [
        {
            "kind": entry.kind,
            "name": entry.name,
            "rule": entry.rule,
            "target": " ".join(files := _files(entry, folders)),
            "command": shlex.join(["./reproduce", *entry.words, *options]),
            **_costs({makers[file] for file in files}, dag, used),
            **(verdicts.get(entry.name, {}) if entry.kind == "claim" else {}),
            "configuration": configuration,
            "machine": machine,
        }
        for entry in entries(plan.root)
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS)).round(3)


def _files(entry: Entry, folders: Folders) -> list[str]:
    own = dict(zip(Folders().documents.values(), folders.documents.values(), strict=True))
    return [own.get(f, folders.results + f.removeprefix(RESULTS)) for f in entry.files]


def _costs(own: set[Any], dag: Any, used: Mapping[Any, Usage | None]) -> dict[str, Any]:
    """Costs of Snakemake's jobs and of all that they need, see `claim_map`."""
    needed = list(dag.bfs(dag.dependencies, *own))
    return {
        "jobs": len(needed),
        "minutes": _minutes([used[job] for job in needed]),
        "minutes_alone": _minutes([used[job] for job in own]),
        "memory": _memory([used[job] for job in needed]),
        "disk": sum(_size(file) for job in needed for file in job.output) / MB,
    }


def _minutes(used: Sequence[Usage | None]) -> float | None:
    """Processor time of jobs; None if one of them was not measured."""
    measured = [one.processor for one in used if one is not None]
    return sum(measured) / 60.0 if len(measured) == len(used) else None


def _memory(used: Sequence[Usage | None]) -> float | None:
    """The most of one job, MB; None if one of them was not measured."""
    measured = [one.memory for one in used if one is not None]
    return max(measured) if measured and len(measured) == len(used) else None


def _size(file: str) -> int:
    """Bytes of a file; none of one that a later step has removed."""
    return Path(file).stat().st_size if Path(file).is_file() else 0


def _verdicts(results: str) -> dict[str, dict[str, str]]:
    path = TABLE.at(results, name="claims")
    if not _intact(path):
        return {}
    kept = ["verdict", "verdict_beyond"]
    return read_table(path, ["claim", *kept]).set_index("claim")[kept].to_dict("index")


def _machine(results: str) -> str:
    path = MACHINE.at(results)
    if not _intact(path):
        return ""
    found = Machine.model_validate_json(Path(path).read_bytes())
    return f"{found.cpu}, {found.cores} cores, {found.system}, Python {found.python}"


def _intact(path: str) -> bool:
    """Whether a file is there as it was written; a damaged one stays where it is."""
    return Path(path).is_file() and check_file(path) is Condition.INTACT
