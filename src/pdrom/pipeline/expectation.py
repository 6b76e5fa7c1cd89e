"""What the jobs of a run are expected to take, told to whoever shows the progress."""

import logging
from typing import Any

from pdrom.pipeline.costs import CostModel
from pdrom.pipeline.measured_costs import kind_of
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.progress import Expected


def tell_expectation(workflow: Any, plan: Plan) -> None:
    """Log what every job of Snakemake's plan is expected to take; see `progress.Estimate.expect`.

    A job's share of this machine is 1 where it is alone, and where jobs run on a cluster.
    """
    dag = workflow.dag
    model = CostModel.of_study(plan.root, plan.results)
    experiments = plan.experiments
    expected: dict[int, Expected] = {}
    after: dict[Any, float] = {}
    # from the last jobs to the first, so that what follows a job is known before
    for job in reversed([job for level in dag.toposorted() for job in level]):
        if not dag.needrun(job):
            continue
        name, labels = job.rule.name, dict(job.wildcards.items())
        kind = kind_of(name, experiments)
        experiment = experiments.get(kind)
        size = plan.size(labels) if experiment else None
        seconds = model.cost(kind, size, labels.get("method") if experiment else name).seconds
        whole = not workflow.local_exec or (experiment is not None and experiment.alone)
        share = 1.0 if whole else 1.0 / workflow.cores
        follows = max((after[other] for other in dag.depending[job] if other in after), default=0.0)
        after[job] = seconds + follows
        expected[dag.jobid(job)] = Expected(seconds, share, follows)
    total = sum(job.seconds for job in expected.values())
    logging.getLogger("snakemake.logging").info(
        f"Jobs take {total:.0f} s one by one where they were measured.",
        extra={"expected": expected},
    )
