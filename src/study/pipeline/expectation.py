"""Expected times of jobs: by kind, as they were measured (see `study.pipeline.tracked`).

Where the last run has measured the units of this machine, times are scaled by them.
"""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pdrom.core.machine import Machine, Units
from pdrom.core.store import read_table
from study.artifact.paths import MACHINE
from study.pipeline.plan import Plan
from study.pipeline.progress import Expected
from study.pipeline.scenes import Coarsen
from study.pipeline.tracked import COLUMNS, COSTS, kind_of

RUN_TIMES = Path("config/reference/run_times.csv")


def units_of(study: str, root: Path) -> Units:
    """Units of the machine that timed a ``study``, full or tiny (`RUN_TIMES` below ``root``)."""
    row = read_table(root / RUN_TIMES, result=False).set_index("study").loc[study]
    return Units(**row[list(Units.model_fields)])


def slower_here(plan: Plan, study: str) -> float:
    """Time of this machine over that of `units_of` for ``study``; 1 if not known.

    Its units stand in the record that ``plan`` names.
    """
    try:
        record = (plan.root / MACHINE.at(plan.results)).read_bytes()
        here = Machine.model_validate_json(record).units
    except (OSError, ValidationError):
        return 1.0  # before the first run, or a record of an older version
    return 1.0 if here is None else here.unit_s / units_of(study, plan.root).unit_s


def expected_seconds(plan: Plan) -> Callable[[str], float]:
    """Function that returns the expected processor seconds of a job of a plan, given its log.

    A kind that was not measured takes the median of all.
    """
    full = plan.settings.coarsen == Coarsen()
    study, column = ("full", "seconds") if full else ("tiny", "coarse_seconds")
    table = read_table(plan.root / COSTS, COLUMNS, result=False)
    seconds = slower_here(plan, study) * table[column]
    known = dict(zip(table.kind, seconds, strict=True))
    usual = float(seconds.median())
    return lambda log: float(known.get(kind_of(log, plan.results), usual))


def tell_expectation(workflow: Any, plan: Plan) -> None:
    """Log what every job of Snakemake's ``workflow`` is expected to take by ``plan``.

    See `progress.Estimate.expect`.

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
