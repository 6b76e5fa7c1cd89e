"""Make the rules of the Snakemake workflow, one for each artifact (function that makes files)."""

from collections.abc import Callable, Iterator
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

from study.artifact.text import to_plain
from study.experiments.kit.base import Experiment
from study.pipeline.plan import Job, Plan

# Kind of job -> name of an output -> its chapter in the report, which shows figures as PNG.
SHOWN = {
    "tables": {"table": "Tables"},
    "figures": {"png": "Figures"},
    "article": {"out": "Page", "main": "Page"},
    "paper": {"main": "Manuscript", "supplement": "Manuscript"},
}
# Attributes of a job that become parameters of its rule: Snakemake reruns the job if one changes.
PARAMETERS = ("settings", "content", "code")


def rules(plan: Plan, cores: int) -> Iterator[SimpleNamespace]:
    """Yield the rule of each artifact of ``plan``; jobs that measure times use all ``cores``.

    Values that differ between jobs are functions of the wildcards. ``shown`` maps names of outputs
    to arguments of Snakemake's function ``report``.
    """
    for experiment in plan.experiments.values():
        yield _experiment(plan, experiment, cores)
    for folder, jobs in plan.fixed.items():
        for job in jobs:
            yield _fixed(plan, job, folder)


def _experiment(plan: Plan, experiment: Experiment, cores: int) -> SimpleNamespace:
    """Return the rule of ``experiment``; it has a job for each combination of its labels."""

    def of(value: Callable[[Job], Any]) -> Callable[[Any], Any]:
        return lambda wildcards: value(plan.job(experiment, wildcards))

    def paths(name: str) -> Callable[[Any], Any]:
        return of(lambda job: job.inputs[name])

    outputs, alone = experiment.writes.items(), experiment.alone
    labels = "_".join(f"{{{label}}}" for label in experiment.labels)
    title = experiment.title.replace("{", "{wildcards.")
    return SimpleNamespace(
        name=experiment.rule,
        input={name: paths(name) for name in experiment.files},
        output={name: f"{plan.results}/{place.pattern}" for name, place in outputs},
        log=f"{plan.results}/logs/{experiment.rule}{'/' if labels else ''}{labels}.log",
        # on a cluster, jobs of a scene form a batch, except those that measure times
        group=None if alone or "scene" not in experiment.labels else "scene",
        threads=cores if alone else 1,
        # a job that measures times gets a whole node of a cluster
        resources={"slurm_extra": "--exclusive"} if alone else {},
        params={"artifact": experiment.address, **{n: of(attrgetter(n)) for n in PARAMETERS}},
        message=f"{title} (no other job meanwhile)" if alone else title,
        shown={},
    )


def _fixed(plan: Plan, job: Job, folder: str) -> SimpleNamespace:
    """Return the rule of ``job``, the only job of its artifact; its log is in logs/``folder``."""
    artifact, outputs = job.artifact, job.outputs
    # the outputs of `paper_inputs` have the same names as documents but are not shown
    chapters = {} if artifact.name == "paper_inputs" else SHOWN[folder]
    labels = {"name": artifact.name, "title": to_plain(artifact.title)}
    return SimpleNamespace(
        name=artifact.rule,
        input=job.inputs,
        output=outputs,
        log=f"{plan.results}/logs/{folder}/{artifact.name}.log",
        group="report",
        threads=1,
        resources={},
        params={"artifact": artifact.address, **{n: getattr(job, n) for n in PARAMETERS}},
        message=f"{folder.capitalize().removesuffix('s')} {next(iter(outputs.values()))}",
        shown={n: {"category": c, "labels": labels} for n, c in chapters.items() if n in outputs},
    )
