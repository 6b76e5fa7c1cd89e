"""Rules of the workflow, one for each artifact."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from study.artifact.artifact import Artifact
from study.experiments.kit.declaration import Experiment
from study.pipeline.figures import FigureJob
from study.pipeline.plan import Plan
from study.pipeline.resolve import Job

KINDS = {"table": "tables", "figure": "figures", "article": "article", "paper": "paper"}


@dataclass(frozen=True)
class Rule:
    """A rule as Snakemake wants it: what depends on a job's labels is a function of wildcards.

    shown : arguments of Snakemake's ``report`` for its outputs, by their name
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
    """Rule of every artifact of ``plan``; one that measures times claims all ``cores``."""
    for experiment in plan.experiments.values():
        yield _experiment(plan, experiment, cores)
    for table in plan.tables.values():
        labels = {"table": table.name, "title": table.title}
        shown = {"table": {"category": "Tables", "labels": labels}}
        yield _fixed(plan, plan.job(table), "table", f"Table {table.name}", shown)
    for figure in plan.figure_jobs.values():
        yield _figure(plan, figure)
    page = plan.page
    shown = {"out": {"category": "Page"}}
    yield _fixed(plan, page, "article", f"Page {page.outputs['out']}", shown)
    paper = plan.paper
    yield _fixed(plan, paper.inputs, "paper", paper.inputs.artifact.title, {})
    files = paper.manuscript.outputs
    shown = {document: {"category": "Manuscript"} for document in files}
    yield _fixed(plan, paper.manuscript, "paper", f"Manuscript {', '.join(files.values())}", shown)
    pages = paper.article
    yield _fixed(plan, pages, "article", pages.artifact.title, {"main": {"category": "Page"}})


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
        output={name: place.rule(plan.results) for name, place in places},
        log=f"{plan.results}/logs/{experiment.rule}{'/' if labels else ''}{labels}.log",
        # scenes have no job in common but their meshes, so that each is a batch on a cluster
        group=None if experiment.alone or "scene" not in experiment.labels else "scene",
        threads=cores if experiment.alone else 1,
        # a job that is to be alone gets a whole node of a cluster
        resources={"slurm_extra": "--exclusive"} if experiment.alone else {},
        params={
            "artifact": experiment.address,
            "settings": of(lambda job: job.settings),
            "content": of(lambda job: job.content),
            "code": of(lambda job: job.code),
        },
        message=f"{title} (alone on the machine)" if experiment.alone else title,
    )


def _figure(plan: Plan, figure: FigureJob) -> Rule:
    # a PNG is what every browser shows
    shown = {"caption": "../report/figure.rst", "category": figure.category}
    rule = _fixed(
        plan,
        figure.job,
        "figure",
        f"Figure {figure.job.artifact.name}",
        {"png": {**shown, "labels": figure.labels}},
    )
    rule.params["rst"] = figure.rst
    return rule


def _fixed(plan: Plan, job: Job, kind: str, message: str, shown: dict[str, dict[str, Any]]) -> Rule:
    """Rule of a single job, without labels."""
    artifact: Artifact = job.artifact
    return Rule(
        name=artifact.rule,
        input=job.inputs,
        output=job.outputs,
        log=f"{plan.results}/logs/{KINDS[kind]}/{artifact.name}.log",
        group="report",
        threads=1,
        resources={},
        params={
            "artifact": artifact.address,
            "settings": job.settings,
            "content": job.content,
            "code": job.code,
        },
        message=message,
        shown=shown,
    )
