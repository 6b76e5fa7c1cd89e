"""Which jobs a file needs, from nothing: the plan as a graph, without Snakemake."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

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
    """Jobs of a plan by what they make."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._made = {file: job for job in self._listed() for file in job.outputs}
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
            for experiment in self._plan.experiments.values()
            for place in experiment.writes.values()
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
        job = self._plan.job(experiment, labels)
        log = "_".join(labels[label] for label in experiment.labels)
        folder = f"{self._plan.results}/logs/{experiment.rule}"
        log = f"{folder}/{log}.log" if log else f"{folder}.log"
        return Job(experiment.rule, log, tuple(job.files), tuple(job.outputs.values()))

    def _listed(self) -> Iterator[Job]:
        """Tables, figures and the manuscript, which the plan lists."""
        for kind, jobs in self._plan.fixed.items():
            for job in jobs:
                log = f"{self._plan.results}/logs/{kind}/{job.artifact.name}.log"
                outputs = tuple(job.outputs.values())
                yield Job(job.artifact.rule, log, tuple(job.files), outputs)
