"""Expected times of jobs: by kind, as they were measured (see `pdrom.pipeline.tracked`)."""

import logging
from collections.abc import Callable
from typing import Any

from pdrom.core.store import read_table
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.progress import Expected
from pdrom.pipeline.scenes import Coarsen
from pdrom.pipeline.tracked import COLUMNS, COSTS, kind_of


def expected_seconds(plan: Plan) -> Callable[[str], float]:
    """Function that returns the expected processor seconds of a job of a plan, given its log.

    A kind that was not measured takes the median of all.
    """
    column = "seconds" if plan.settings.coarsen == Coarsen() else "coarse_seconds"
    table = read_table(plan.root / COSTS, COLUMNS, result=False)
    known = dict(zip(table.kind, table[column], strict=True))
    return lambda log: float(known.get(kind_of(log, plan.results), table[column].median()))


def tell_expectation(workflow: Any, plan: Plan) -> None:
    """Log what every job of Snakemake's plan is expected to take; see `progress.Estimate.expect`.

    A job's share of this machine is 1 where it is alone, and where jobs run on a cluster.
    """
    dag, seconds_of = workflow.dag, expected_seconds(plan)
    expected: dict[int, Expected] = {}
    after: dict[Any, float] = {}
    # from the last jobs to the first, so that what follows a job is known before
    for job in reversed([job for level in dag.toposorted() for job in level]):
        if not dag.needrun(job) or not job.log:
            continue
        seconds = seconds_of(str(job.log[0]))
        share = min(job.threads / workflow.cores, 1.0) if workflow.local_exec else 1.0
        follows = max((after[other] for other in dag.depending[job] if other in after), default=0.0)
        after[job] = seconds + follows
        expected[dag.jobid(job)] = Expected(seconds, share, follows)
    total = sum(job.seconds for job in expected.values())
    logging.getLogger("snakemake.logging").info(
        f"Jobs take {total:.0f} s one by one where they were measured.",
        extra={"expected": expected},
    )
