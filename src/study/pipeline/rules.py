"""Rules of the Snakemake workflow, one for each artifact (function declared to make files)."""

from collections.abc import Callable, Iterator, Mapping
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

from study.artifact.markup import to_plain, to_rst
from study.experiments.kit.base import Experiment
from study.figures.kit.declaration import Declaration
from study.paper.build import Numbers, figure_numbers
from study.pipeline.plan import Job, Plan
from study.tables.kit.declaration import Table

UNNUMBERED = "–"
# Attributes of a job that become parameters of its rule: Snakemake reruns the job if one changes.
PARAMETERS = ("settings", "content", "code")


def rules(plan: Plan, cores: int) -> Iterator[SimpleNamespace]:
    """Yield the rule of each artifact of ``plan``; jobs that measure times use all ``cores``.

    A yielded object has the attributes of a Snakemake rule; values that differ between jobs are
    functions of the wildcards. Its attribute ``shown``, for the HTML report, maps names of outputs
    to arguments of Snakemake's function ``report``.
    """
    for experiment in plan.experiments.values():
        yield _experiment(plan, experiment, cores)
    numbers = figure_numbers(plan.study.root)
    for folder, jobs in plan.fixed.items():
        for job in jobs:
            yield _fixed(plan, job, folder, numbers)


def _experiment(plan: Plan, experiment: Experiment, cores: int) -> SimpleNamespace:
    def of(value: Callable[[Job], Any]) -> Callable[[Any], Any]:
        return lambda wildcards: value(plan.job(experiment, wildcards))

    def paths(name: str) -> Callable[[Any], Any]:
        return of(lambda job: job.inputs[name])

    labels = "_".join(f"{{{label}}}" for label in experiment.labels)
    title = experiment.title.replace("{", "{wildcards.")
    return SimpleNamespace(
        name=experiment.rule,
        input={name: paths(name) for name in experiment.files},
        output={
            name: f"{plan.results}/{place.pattern}" for name, place in experiment.writes.items()
        },
        log=f"{plan.results}/logs/{experiment.rule}{'/' if labels else ''}{labels}.log",
        # on a cluster, a scene's jobs form a batch; those that measure times or lack a scene do not
        group=None if experiment.alone or "scene" not in experiment.labels else "scene",
        threads=cores if experiment.alone else 1,
        # a job that measures times gets a whole node of a cluster
        resources={"slurm_extra": "--exclusive"} if experiment.alone else {},
        params={"artifact": experiment.address, **{n: of(attrgetter(n)) for n in PARAMETERS}},
        message=f"{title} (alone on the machine)" if experiment.alone else title,
        shown={},
    )


def _fixed(plan: Plan, job: Job, folder: str, numbers: Mapping[str, Numbers]) -> SimpleNamespace:
    """Snakemake rule of ``job``, the only one of its artifact, with its log in logs/``folder``."""
    artifact, paths = job.artifact, job.outputs
    params = {"artifact": artifact.address, **{name: getattr(job, name) for name in PARAMETERS}}
    shown: dict[str, dict[str, Any]] = {}
    if isinstance(artifact, Table):
        message = f"Table {artifact.name}"
        labels = {"table": artifact.name, "title": artifact.title}
        shown = {"table": {"category": "Tables", "labels": labels}}
    elif isinstance(artifact, Declaration):
        message = f"Figure {artifact.name}"
        # the report shows the PNG, which every browser can display
        shown = {"png": _figure(artifact, numbers[artifact.name])}
        title, caption = artifact.words(plan.study.value)
        params["rst"] = f"**{to_rst(title)}.** {to_rst(caption)}"
    elif folder == "article":
        message = f"Page {paths['out']}" if "out" in paths else artifact.title
        shown = {name: {"category": "Page"} for name in ("out", "main") if name in paths}
    elif artifact.name == "paper":
        message = f"Manuscript {', '.join(paths.values())}"
        shown = {document: {"category": "Manuscript"} for document in paths}
    else:
        message = artifact.title
    return SimpleNamespace(
        name=artifact.rule,
        input=job.inputs,
        output=paths,
        log=f"{plan.results}/logs/{folder}/{artifact.name}.log",
        group="report",
        threads=1,
        resources={},
        params=params,
        message=message,
        shown=shown,
    )


def _figure(figure: Declaration, numbers: Numbers) -> dict[str, Any]:
    """Arguments of Snakemake's ``report`` for a figure; reports sort figures by first label."""
    own = {"paper": numbers.manuscript or UNNUMBERED}
    if numbers.preprint is None:
        category, labels = "Figures of this study", {"name": figure.name, **own}
    else:
        category = "Figures of the preprint"
        labels = {"preprint": str(numbers.preprint), **own, "name": figure.name}
    labels["title"] = to_plain(figure.title)
    return {"caption": "../report/figure.rst", "category": category, "labels": labels}
