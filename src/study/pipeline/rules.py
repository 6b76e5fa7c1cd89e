"""Rules of the Snakemake workflow, one for each artifact (declared function that makes files)."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

from study.artifact.markup import to_plain, to_rst
from study.experiments.kit.declaration import Experiment
from study.figures.kit.declaration import Declaration
from study.paper.figure_numbers import Numbers, figure_numbers
from study.pipeline.plan import Plan
from study.pipeline.resolve import Job
from study.tables.kit.declaration import Table

UNNUMBERED = "–"
# Attributes of a job that the workflow tracks as parameters, in addition to its files.
PARAMETERS = ("settings", "content", "code")


@dataclass(frozen=True)
class Rule:
    """A rule of Snakemake; values that depend on a job's labels are functions of the wildcards.

    shown : arguments of Snakemake's function ``report`` for each output to show, by output name
    """

    name: str
    input: dict[str, Any]
    output: dict[str, str]
    log: str
    group: str | None
    threads: int
    resources: dict[str, Any]
    params: dict[str, Any]
    message: str
    shown: dict[str, dict[str, Any]] = field(default_factory=dict)


def rules(plan: Plan, cores: int) -> Iterator[Rule]:
    """Yield the rule of each artifact of ``plan``; rules that measure times claim ``cores``."""
    for experiment in plan.experiments.values():
        yield _experiment(plan, experiment, cores)
    numbers = figure_numbers(plan.root)
    for folder, jobs in plan.fixed.items():
        for job in jobs:
            yield _fixed(plan, job, folder, numbers)


def _experiment(plan: Plan, experiment: Experiment, cores: int) -> Rule:
    def of(value: Callable[[Job], Any]) -> Callable[[Any], Any]:
        return lambda wildcards: value(plan.job(experiment, wildcards))

    def paths(name: str) -> Callable[[Any], Any]:
        return of(lambda job: job.inputs[name])

    labels = "_".join(f"{{{label}}}" for label in experiment.labels)
    title = experiment.title.replace("{", "{wildcards.")
    places = experiment.writes.items()
    return Rule(
        name=experiment.rule,
        input={name: paths(name) for name in experiment.files},
        output={name: f"{plan.results}/{place.pattern}" for name, place in places},
        log=f"{plan.results}/logs/{experiment.rule}{'/' if labels else ''}{labels}.log",
        # scenes share no jobs except their meshes, so that a scene's jobs form a batch on a cluster
        group=None if experiment.alone or "scene" not in experiment.labels else "scene",
        threads=cores if experiment.alone else 1,
        # a job that measures times gets a whole node of a cluster
        resources={"slurm_extra": "--exclusive"} if experiment.alone else {},
        params={
            "artifact": experiment.address,
            **{name: of(attrgetter(name)) for name in PARAMETERS},
        },
        message=f"{title} (alone on the machine)" if experiment.alone else title,
    )


def _fixed(plan: Plan, job: Job, folder: str, numbers: Mapping[str, Numbers]) -> Rule:
    """Rule of a job without labels; ``numbers``: figure numbers in manuscript and preprint."""
    artifact = job.artifact
    params = {"artifact": artifact.address, **{name: getattr(job, name) for name in PARAMETERS}}
    if isinstance(artifact, Declaration):
        title, caption = artifact.words(plan.study.value)
        params["rst"] = f"**{to_rst(title)}.** {to_rst(caption)}"
    message, shown = _presented(job, numbers)
    return Rule(
        name=artifact.rule,
        input=job.inputs,
        output=job.outputs,
        log=f"{plan.results}/logs/{folder}/{artifact.name}.log",
        group="report",
        threads=1,
        resources={},
        params=params,
        message=message,
        shown=shown,
    )


def _presented(job: Job, numbers: Mapping[str, Numbers]) -> tuple[str, dict[str, dict[str, Any]]]:
    """Message of a job, and the arguments of ``report`` for each output that the report shows."""
    artifact, paths = job.artifact, job.outputs
    if isinstance(artifact, Table):
        labels = {"table": artifact.name, "title": artifact.title}
        return f"Table {artifact.name}", {"table": {"category": "Tables", "labels": labels}}
    if isinstance(artifact, Declaration):
        # the report shows the PNG, which every browser can display
        return f"Figure {artifact.name}", {"png": _figure(artifact, numbers[artifact.name])}
    shown = {
        "live_page": {"out": {"category": "Page"}},
        "article": {"main": {"category": "Page"}},
        "paper": {document: {"category": "Manuscript"} for document in paths},
    }
    where = {"live_page": "Page", "paper": "Manuscript"}.get(artifact.name)
    message = f"{where} {', '.join(paths.values())}" if where else artifact.title
    return message, shown.get(artifact.name, {})


def _figure(figure: Declaration, numbers: Numbers) -> dict[str, Any]:
    """Arguments of ``report`` for a figure; the report sorts figures by their first label."""
    own = {"paper": numbers.manuscript or UNNUMBERED}
    if numbers.preprint is None:
        category, labels = "Figures of this study", {"name": figure.name, **own}
    else:
        category = "Figures of the preprint"
        labels = {"preprint": str(numbers.preprint), **own, "name": figure.name}
    labels["title"] = to_plain(figure.title)
    return {"caption": "../report/figure.rst", "category": category, "labels": labels}
