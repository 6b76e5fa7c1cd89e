"""Jobs of the experiments: what their rules need from a study."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any

from pdrom.core.paths import Place
from pdrom.core.reads import EachOf, Every, ProjectFile, SourcesOf
from pdrom.experiments.kit.declaration import Experiment, JobSettings, Source, experiments
from pdrom.pipeline.fingerprint import digest, fingerprint
from pdrom.pipeline.holdings import labels_of
from pdrom.pipeline.providers import provide, scaled_methods
from pdrom.pipeline.study import Study

Labels = Mapping[str, str]


@dataclass(frozen=True)
class _Job:
    """An experiment with the labels and settings of one of its jobs."""

    experiment: Experiment
    labels: Labels
    settings: JobSettings


class Jobs:
    """Rules of the experiments: inputs, outputs, parameters; ``results`` is the results folder.

    What depends on a job's labels is a function of them (of the rule's wildcards).
    """

    def __init__(self, study: Study, results: str, package: str = "pdrom.experiments") -> None:
        self._study, self._results, self._package = study, results, package
        self._settings: dict[tuple[str, ...], JobSettings] = {}
        self._prints: dict[tuple[str, ...], str] = {}

    @cached_property
    def experiments(self) -> list[Experiment]:
        """All experiments, sorted by name."""
        return experiments(self._package)

    def check(self) -> None:
        """ConfigurationError for settings that name what does not exist."""
        scaled_methods(self._study, {})

    def outputs(self, experiment: Experiment) -> dict[str, str]:
        """Paths with labels in braces."""
        return {name: place.rule(self._results) for name, place in experiment.outputs.items()}

    def log(self, experiment: Experiment) -> str:
        """Log file with labels in braces."""
        labels = "_".join(f"{{{label}}}" for label in experiment.labels)
        return f"{self._results}/logs/{experiment.name}{'/' if labels else ''}{labels}.log"

    def message(self, experiment: Experiment) -> str:
        """What a run prints about a job."""
        label = experiment.label.replace("{", "{wildcards.")
        return f"{label} (alone on the machine)" if experiment.alone else label

    def inputs(self, experiment: Experiment) -> dict[str, Callable[..., Any]]:
        """Files of each input, by the job's labels."""
        return {name: self._input(experiment, name) for name in experiment.inputs}

    def _input(self, experiment: Experiment, name: str) -> Callable[..., Any]:
        source = experiment.inputs[name]
        return self._of(experiment, lambda job: self._files(job, source))

    def params(self, experiment: Experiment) -> dict[str, Any]:
        """What a job depends on, beside the dates of its files: settings, edited files, code."""
        return {
            "module": experiment.module,
            "settings": self._of(experiment, lambda job: job.settings.model_dump(mode="json")),
            "content": self._of(experiment, self._content),
            "code": self._of(experiment, lambda job: self._code(job)),
        }

    def threads(self, experiment: Experiment, cores: int) -> int:
        """Threads that a job claims: all ``cores`` if it runs alone."""
        if experiment.alone:
            return cores
        return self._study.settings.threads if "threads" in experiment.settings.model_fields else 1

    def resources(self, experiment: Experiment) -> dict[str, Any]:
        """A whole node of a cluster for a job that is to be alone; see also the profile."""
        return {"slurm_extra": "--exclusive"} if experiment.alone else {}

    def group(self, experiment: Experiment) -> str | None:
        """Group of jobs of which a cluster runs those that hang together as one batch.

        Scenes have no job in common but their meshes, so that each is a batch; Snakemake's option
        ``--group-components scene=10`` makes one of ten.
        """
        return None if experiment.alone or "scene" not in experiment.labels else "scene"

    def settings(self, experiment: Experiment, labels: Labels) -> JobSettings:
        """Validated settings of a job."""
        key = (experiment.name, *(labels[name] for name in experiment.labels))
        if key not in self._settings:
            fields = experiment.settings.model_fields
            values = {name: provide(self._study, name, labels) for name in fields}
            self._settings[key] = experiment.settings.model_validate(values)
        return self._settings[key]

    def _of(self, experiment: Experiment, value: Callable[[_Job], Any]) -> Callable[..., Any]:
        """``value`` as the function of wildcards that the workflow calls."""

        def of_wildcards(wildcards: Any) -> Any:
            labels = {name: wildcards[name] for name in experiment.labels}
            return value(_Job(experiment, labels, self.settings(experiment, labels)))

        return of_wildcards

    def _files(self, job: _Job, source: Source) -> str | list[str]:
        match source:
            case Place():
                return self._one(source, job.labels)
            case Every(place):
                return self._every(place, job.labels)
            case EachOf(key, place):
                entries = getattr(job.settings, key)
                return [self._one(place, entry.labels) for entry in entries]
            case ProjectFile(path):
                return path
            case SourcesOf(key):
                return list(attrgetter(key)(job.settings).sources)

    def _one(self, place: Place, labels: Labels) -> str:
        return place.at(self._results, **self._labels(place, labels))

    def _labels(self, place: Place, labels: Labels) -> dict[str, str]:
        """Labels of a file, some of which follow from those of the job."""
        found = dict(labels)
        if "mesh" in place.labels and "mesh" not in found:
            found["mesh"] = self._study.mesh_of(found["scene"])
        if "basis" in place.labels and "basis" not in found:
            found["basis"] = self._study.methods[found["method"]].basis_id
        return {name: found[name] for name in place.labels}

    def _every(self, place: Place, labels: Labels) -> list[str]:
        study = self._study.only(labels["scene"]) if "scene" in labels else self._study
        agree = [
            held
            for held in labels_of(study, place)
            if all(held[name] == labels[name] for name in held.keys() & labels.keys())
        ]
        return [place.at(self._results, **held) for held in agree]

    def _content(self, job: _Job) -> str:
        """Checksum of the files that people edit: their dates may be set back."""
        sources = job.experiment.inputs.values()
        edited = [s for s in sources if isinstance(s, (ProjectFile, SourcesOf))]
        files = [f for s in edited for f in _listed(self._files(job, s))]
        return digest(self._study.root, *files) if files else ""

    def _code(self, job: _Job) -> str:
        modules = (job.experiment.module, *job.settings.loaded)
        if modules not in self._prints:
            self._prints[modules] = fingerprint(*modules)
        return self._prints[modules]


def _listed(files: str | list[str]) -> list[str]:
    return [files] if isinstance(files, str) else files
