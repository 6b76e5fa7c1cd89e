"""Find results that do not fit the plan although Snakemake, which compares dates, would keep them.

A checksum records the path, settings, code and inputs of a result. `force` makes Snakemake compute
unfit results again, and with them all results that depend on them.
"""

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from pdrom.core.errors import StorageError
from pdrom.core.provenance import ORIGIN
from pdrom.core.store import Condition, check_file, checksum_path
from pdrom.core.store.checksum import provenance_of, read_checksum
from study.artifact.paths import labels_in
from study.pipeline.fingerprint import Memory
from study.pipeline.plan import Job, Plan

MISSING = "output is missing"
DAMAGED = "output is damaged"
FOREIGN = "output was copied from another result"
CHANGED = "settings or code have changed"
STALE = "output was made from other inputs"
FILES = 20_000  # largest number of files for which the content of checksums is kept
# Faults that neither an edit nor an interrupted run causes; a run reports each file with one.
UNUSUAL = (MISSING, DAMAGED, FOREIGN)


class Checked(Memory):
    """Cache of the checksums of results, by path, size, inode and dates of result and checksum.

    The bytes of a file are compared with its checksum only if one of these has changed.
    """

    def __init__(self, results: str) -> None:
        super().__init__(Path(results, ".checked.json"), FILES)

    def told(self, path: str) -> dict[str, str] | None:
        """Return digest and origin in the checksum of ``path``: {} if damaged, None if missing."""
        state, exists = _state(path)
        told: dict[str, str] | None = self.get(lambda: _read(path), path, state) if exists else None
        return told

    def distrust(self, paths: Iterable[str]) -> None:
        """Count ``paths`` as damaged from now on, until they are made again."""
        for path in paths:
            self.put({}, path, _state(path)[0])


def _state(path: str) -> tuple[str, bool]:
    """Return size, inode, dates of ``path`` and its checksum as text; whether ``path`` exists."""
    found: list[Any] = []
    for each in (path, os.fspath(checksum_path(path))):
        try:
            stat = os.stat(each)
            found.append([stat.st_size, stat.st_ino, stat.st_mtime_ns, stat.st_ctime_ns])
        except OSError:  # a broken link counts as existing
            found.append(os.path.lexists(each))
    return str(found), bool(found[0])


def _read(path: str) -> dict[str, str]:
    with suppress(StorageError):  # a folder, a broken link, or no permission
        if check_file(path) is Condition.INTACT and (checksum := read_checksum(path)):
            told = provenance_of(path)
            return {"digest": checksum.digest, **{key: told.get(key, "") for key in ORIGIN}}
    return {}


def faults(plan: Plan, targets: Sequence[str] = ()) -> dict[str, str]:
    """Map each unfit file that ``targets`` (by default, the whole study) need to its fault.

    A missing file counts if a file made from it exists; Snakemake notices other missing files.
    """
    jobs, checked = needed(plan, targets), Checked(plan.results)
    told = {path: checked.told(path) for path in jobs}
    checked.save()
    there = [job for path, job in jobs.items() if told[path] is not None]
    used = {path for job in there for path in (*job.files, *job.outputs.values())}
    found: dict[str, str] = {}
    for path, job in jobs.items():  # inputs come before the files that are made from them
        own, inputs = told[path], [told.get(name) or {} for name in job.results]
        if own:
            expected = job.origin(path, [one.get("digest", "") for one in inputs])
            other = [key for key, value in expected.items() if own[key] != value]
            if other == ["inputs_sha256"]:  # if inputs are made again, Snakemake repeats this job
                fault = STALE if all(inputs) and found.keys().isdisjoint(job.results) else ""
            else:
                foreign = "file" in other and own["file"]
                fault = FOREIGN if foreign else CHANGED if other else ""
        else:
            fault = DAMAGED if own is not None else MISSING if path in used else ""
        if fault:
            found[path] = fault
    return found


def needed(plan: Plan, targets: Sequence[str] = ()) -> dict[str, Job]:
    """Map all files that ``targets`` (paths, rules; default: all) need to jobs, inputs first."""
    fixed = [job for jobs in plan.fixed.values() for job in jobs]
    rules = {job.artifact.rule: [*job.outputs.values()] for job in fixed}
    makers = {path: job for job in fixed for path in job.outputs.values()}
    experiments = {p: made for made in plan.experiments.values() for p in made.writes.values()}
    found: dict[str, Job] = {}

    def visit(path: str) -> None:
        known = labels_in(path, plan.results, experiments)
        made = (plan.job(experiments[place], labels) for place, labels in known)
        if path not in found and (job := makers.get(path) or next(made, None)):
            for read in job.results:
                visit(read)
            found.update(dict.fromkeys(job.outputs.values(), job))

    study = not targets or not {"study", "all"}.isdisjoint(targets)
    for target in plan.made if study else targets:
        for path in rules.get(target, [os.path.normpath(target)]):
            visit(path)
    return found


def force(workflow: Any, files: Iterable[str]) -> None:
    """Make Snakemake's ``workflow`` run the jobs of ``files`` as with its option ``--forcerun``."""

    def settle(self: Any, settings: Any) -> None:
        vars(self)["dag_settings"] = replace(settings, forcerun={*settings.forcerun, *files})

    # Snakemake sets its options after it has read the rules
    type(workflow).dag_settings = property(lambda self: vars(self)["dag_settings"], settle)
