"""Expected times of jobs: mean processor seconds by kind of job, of two runs that were measured.

`config/reference/job_costs.csv` holds them for the meshes of the full study and for the coarse ones
of the study `tiny`, with the longest time and the largest memory of a job, which the requests of
`workflow/profiles/slurm` are to cover. A kind is what a job's log is named by below ``logs``: an
experiment, or ``tables``, ``figures`` or ``paper``.

``./reproduce run python -m pdrom.pipeline.expectation`` writes the file anew, from the logs of both
studies in ``results``.
"""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.errors import PdromError
from pdrom.core.store import read_table
from pdrom.core.usage import usage_of
from pdrom.pipeline.folders import folders
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.progress import Expected
from pdrom.pipeline.scenes import Coarsen
from pdrom.pipeline.tracked import write_tracked

MEASURED = Path("config/reference/job_costs.csv")
COLUMNS = ["kind", "seconds", "coarse_seconds", "longest_s", "memory_mb"]
COARSE = "config/tiny.yaml"


def expected_seconds(plan: Plan) -> Callable[[str], float]:
    """Function that returns the expected processor seconds of a job of a plan, given its log.

    A kind that was not measured takes the median of all.
    """
    column = "seconds" if plan.settings.coarsen == Coarsen() else "coarse_seconds"
    table = read_table(plan.root / MEASURED, COLUMNS, result=False)
    known = dict(zip(table.kind, table[column], strict=True))
    return lambda log: float(known.get(_kind(log, plan.results), table[column].median()))


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


def measured_costs(results: str, coarse: str) -> pd.DataFrame:
    """A row for each kind of job, with the `COLUMNS`: what the logs of two runs say.

    Parameters
    ----------
    results, coarse : results folders of the full study and of one with coarse meshes

    Raises
    ------
    PdromError
        If no log says what a job used: there was no run.
    """
    full = _used(results).groupby("kind")
    columns = [
        full.processor.mean().round(2),
        _used(coarse).groupby("kind").processor.mean().round(2),
        full.wall.max().round(1),
        full.memory.max().round().astype(int),
    ]
    return pd.concat(columns, axis=1, keys=COLUMNS[1:]).reset_index()


def _used(results: str) -> pd.DataFrame:
    rows = [
        {"kind": _kind(str(log), results), **vars(used)}
        for log in sorted(Path(results, "logs").rglob("*.log"))
        if (used := usage_of(log)) is not None
    ]
    if not rows:
        raise PdromError(f"{results}/logs: no job says what it used; run the study first")
    return pd.DataFrame(rows)


def _kind(log: str, results: str) -> str:
    return Path(log).relative_to(Path(results, "logs")).parts[0].removesuffix(".log")


def main() -> None:
    """Write the measured costs of both studies."""
    made = measured_costs(folders([], []).results, folders([COARSE], []).results)
    write_tracked(MEASURED, made.to_csv(index=False).encode())


if __name__ == "__main__":
    main()
