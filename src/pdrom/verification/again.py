"""Results made again from the files at hand: tables, figures, inputs of the manuscript, manuscript.

A file that was replaced together with its checksum and its entry in the manifest is not what its
inputs give. The results of experiments take too long for that: of them only checksums are compared.
"""

import filecmp
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from pdrom.core.errors import PdromError, StorageError
from pdrom.core.reads import Every, Preferred
from pdrom.pipeline.folders import Folders
from pdrom.pipeline.plan import Plan
from pdrom.report.drawing import draw
from pdrom.report.paper.build import build, write_inputs
from pdrom.tables import declared
from pdrom.tables.kit.make import make_table

REFERENCES = "paper/references.bib"
# Faults that edited tables lead a job to.
FAULTS = (PdromError, ArithmeticError, LookupError, TypeError, ValueError)


@dataclass(frozen=True)
class Job:
    """A rule that takes seconds.

    make : from the folder in which the files are made
    """

    inputs: list[str]
    outputs: list[str]
    make: Callable[[Path], None]


@contextmanager
def made(job: Job) -> Iterator[dict[str, Path]]:
    """Files that a job makes now, by the path that each has in the study.

    Raises
    ------
    StorageError
        It cannot be made from the files at hand.
    """
    with TemporaryDirectory(prefix="pdrom-again-") as folder:
        try:
            job.make(Path(folder))
        except FAULTS as error:
            fault = " ".join(str(error).split())
            raise StorageError(f"{job.outputs[0]}: cannot be made again ({fault})") from error
        yield {path: Path(folder, Path(path).name) for path in job.outputs}


def differing(job: Job) -> list[str]:
    """Outputs of a job that are not what its inputs give; all of them if these give none."""
    try:
        with made(job) as files:
            return [old for old, new in files.items() if not filecmp.cmp(old, new, shallow=False)]
    except StorageError:
        return job.outputs


def jobs(plan: Plan, folders: Folders) -> Iterator[Job]:
    """Jobs in the order in which a run needs them."""
    yield from (table_job(plan, name) for name in plan.tables)
    for name, job in plan.figure_jobs.items():
        yield Job(job.inputs, [job.pdf, job.png], partial(_draw, plan, name))
    paper = plan.paper
    read = [*paper.sources, REFERENCES, *plan.tables.paths, paper.machine]
    yield Job(read, paper.inputs, partial(_write_inputs, plan))
    read = [*paper.sources, *paper.inputs, *plan.figures]
    yield Job(read, [folders.manuscript], partial(_build, plan, folders.manuscript))


def is_derived(name: str) -> bool:
    """Whether a table is made from other tables alone."""
    reads = declared()[name].reads.values()
    return not any(isinstance(read, Every | Preferred) for read in reads)


def table_job(plan: Plan, name: str) -> Job:
    """The job of a table."""
    inputs = plan.tables.inputs(name)
    files = chain.from_iterable([f] if isinstance(f, str) else f for f in inputs.values())
    return Job(list(files), [plan.tables.path(name)], partial(_make_table, plan, name))


def _make_table(plan: Plan, name: str, folder: Path) -> None:
    made = plan.tables.params(name)
    output = folder / Path(plan.tables.path(name)).name
    make_table(made["module"], plan.tables.inputs(name), made["settings"], str(output))


def _draw(plan: Plan, name: str, folder: Path) -> None:
    job = plan.figure_jobs[name]
    pdf, png = (str(folder / Path(path).name) for path in (job.pdf, job.png))
    draw(job.order, plan.results, pdf, png)


def _write_inputs(plan: Plan, folder: Path) -> None:
    paper = plan.paper
    source, machine = paper.sources[0], paper.machine
    write_inputs(source, REFERENCES, plan.tables.paths, machine, paper.facts, str(folder))


def _build(plan: Plan, manuscript: str, folder: Path) -> None:
    output = str(folder / Path(manuscript).name)
    build(plan.paper.sources[0], plan.figures, plan.paper.inputs, output)
