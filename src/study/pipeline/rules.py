"""Rules of the workflow, one for each artifact."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from study.artifact.markup import to_plain, to_rst
from study.experiments.kit.declaration import Experiment
from study.figures.kit.declaration import Declaration
from study.paper.figure_numbers import Numbers, figure_numbers
from study.pipeline.figures import words
from study.pipeline.plan import Plan
from study.pipeline.resolve import Job
from study.tables.kit.declaration import Table

UNNUMBERED = "–"


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
    numbers = figure_numbers(plan.root)
    for folder, jobs in plan.fixed.items():
        for job in jobs:
            yield _fixed(plan, job, folder, numbers.get(job.artifact.name))


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


def _fixed(plan: Plan, job: Job, folder: str, numbers: Numbers | None) -> Rule:
    """Rule of a single job, without labels; ``numbers`` of a figure of its name."""
    artifact = job.artifact
    params = {
        "artifact": artifact.address,
        "settings": job.settings,
        "content": job.content,
        "code": job.code,
    }
    message, shown = _presented(job)
    if isinstance(artifact, Declaration) and numbers is not None:
        title, caption = words(plan.study, artifact)
        params["rst"] = f"**{to_rst(title)}.** {to_rst(caption)}"
        # a PNG is what every browser shows
        shown = {"png": {"caption": "../report/figure.rst", **_figure(artifact, numbers)}}
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


def _presented(job: Job) -> tuple[str, dict[str, dict[str, Any]]]:
    """Message of a job, and what Snakemake's report shows of its outputs."""
    artifact, paths = job.artifact, job.outputs
    match artifact.name:
        case _ if isinstance(artifact, Table):
            labels = {"table": artifact.name, "title": artifact.title}
            return f"Table {artifact.name}", {"table": {"category": "Tables", "labels": labels}}
        case _ if isinstance(artifact, Declaration):
            return f"Figure {artifact.name}", {}
        case "live_page":
            return f"Page {paths['out']}", {"out": {"category": "Page"}}
        case "article":
            return artifact.title, {"main": {"category": "Page"}}
        case "paper":
            shown = {document: {"category": "Manuscript"} for document in paths}
            return f"Manuscript {', '.join(paths.values())}", shown
    return artifact.title, {}


def _figure(figure: Declaration, numbers: Numbers) -> dict[str, Any]:
    """Category and labels of a figure in the report, which is sorted by the first label."""
    own = {"paper": numbers.manuscript or UNNUMBERED, "name": figure.name}
    title = {"title": to_plain(figure.title)}
    if numbers.preprint is None:
        labels = {"name": figure.name, "paper": own["paper"], **title}
        return {"category": "Figures of this study", "labels": labels}
    labels = {"preprint": str(numbers.preprint), **own, **title}
    return {"category": "Figures of the preprint", "labels": labels}
