"""Which jobs a file needs, from nothing: the plan as a graph, without Snakemake."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from pdrom.core.errors import StorageError
from pdrom.core.paths import Place
from pdrom.experiments.kit.declaration import Experiment
from pdrom.pipeline.plan import Plan


@dataclass(frozen=True)
class Job:
    """A job of the workflow: the name of its rule, its log, what it reads and writes."""

    rule: str
    log: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


class Graph:
    """Jobs of a plan by what they make; ``manuscript`` is the PDF."""

    def __init__(self, plan: Plan, manuscript: str) -> None:
        self._plan = plan
        self._made = {file: job for job in self._listed(manuscript) for file in job.outputs}
        self.maker = cache(self._maker)

    def needed(self, targets: Iterable[str]) -> list[Job]:
        """Every job that has to run before the targets are there, theirs included."""
        found: dict[Job, None] = {}
        waiting = list(targets)
        while waiting:
            job = self.maker(waiting.pop())
            if job is not None and job not in found:
                found[job] = None
                waiting += job.inputs
        return list(found)

    def _maker(self, path: str) -> Job | None:
        """The job that makes a file; None for one that people edit."""
        if path in self._made:
            return self._made[path]
        found = [
            (experiment, labels)
            for experiment in self._plan.jobs.experiments
            for place in experiment.outputs.values()
            if (labels := self._labels(place, path)) is not None
        ]
        # `{group}` would match `spring_frames`, too; Snakemake takes the shortest labels
        found.sort(key=lambda match: sum(map(len, match[1].values())))
        return self._job(*found[0]) if found else None

    def _labels(self, place: Place, path: str) -> dict[str, str] | None:
        try:
            labels = place.file(path).labels
        except StorageError:
            return None
        return labels if place.at(self._plan.results, **labels) == path else None

    def _job(self, experiment: Experiment, labels: dict[str, str]) -> Job:
        jobs = self._plan.jobs
        return Job(
            rule=experiment.name,
            log=jobs.log(experiment).format(**labels),
            inputs=_flat(files(labels) for files in jobs.inputs(experiment).values()),
            outputs=tuple(path.format(**labels) for path in jobs.outputs(experiment).values()),
        )

    def _listed(self, manuscript: str) -> Iterator[Job]:
        """Tables, figures and the manuscript, which the plan lists."""
        plan, tables = self._plan, self._plan.tables
        for name in tables:
            inputs = _flat(tables.inputs(name).values())
            yield Job(f"{name}_table", tables.log(name), inputs, (tables.path(name),))
        for name, figure in plan.figure_jobs.items():
            yield Job(f"figure_{name}", figure.log, _flat(figure.inputs), (figure.pdf, figure.png))
        paper, logs = plan.paper, f"{plan.results}/logs/paper"
        numbers = _flat((tables.paths, paper.machine, paper.sources))
        yield Job("paper_inputs", f"{logs}/inputs.log", numbers, tuple(paper.inputs))
        pieces = _flat((paper.sources, paper.inputs, plan.figures))
        yield Job("paper", f"{logs}/main.log", pieces, (manuscript,))


def _flat(files: Iterable[Any]) -> tuple[str, ...]:
    """Paths, of which some come in lists."""
    listed = (entry if isinstance(entry, list | tuple) else [entry] for entry in files)
    return tuple(str(path) for entries in listed for path in entries)
