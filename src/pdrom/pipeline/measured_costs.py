"""Measured jobs for the cost model, collected from the logs of a finished run.

``./reproduce run python -m pdrom.pipeline.measured_costs`` writes `config/reference/job_costs.csv`
anew, from the full study in ``results``.
"""

import logging
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.errors import PdromError
from pdrom.core.usage import usage_of
from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.costs import COLUMNS, MEASURED
from pdrom.pipeline.folders import DEFAULT, Folders
from pdrom.pipeline.graph import Graph
from pdrom.pipeline.plan import Plan, load_plan
from pdrom.pipeline.tracked import write_tracked

SIZES = ("elements", "vertices", "frames", "iterations")
# Kinds of the jobs that no experiment is, by how the names of their rules begin or end.
OTHERS = {"_table": "table", "figure_": "figure", "paper": "paper"}
OF_OTHERS = "figure"  # the kind that counts for rules of no kind

log = logging.getLogger(__name__)


def measured_costs(plan: Plan, manuscript: str) -> pd.DataFrame:
    """A row for each job whose log says what it used, with the columns of the cost model.

    Raises
    ------
    PdromError
        If no log says it: there was no run.
    """
    rows = list(_rows(plan, manuscript))
    if not rows:
        raise PdromError(f"{plan.results}/logs: no job says what it used; run the study first")
    table = pd.DataFrame(rows, columns=COLUMNS)
    table = table.astype(dict.fromkeys(SIZES, "Int64"))
    return table.sort_values([c for c in COLUMNS if c != "memory_mb"], ignore_index=True)


def kind_of(rule: str, experiments: Container[str]) -> str:
    """Kind of a rule's jobs."""
    if rule in experiments:
        return rule
    return next((kind for part, kind in OTHERS.items() if part in rule), OF_OTHERS)


def _rows(plan: Plan, manuscript: str) -> Iterator[dict[str, Any]]:
    experiments = plan.experiments
    for job in Graph(plan).needed([manuscript]):
        used = usage_of(job.log)
        if used is None:
            log.warning("%s: does not say what the job used", job.log)
            continue
        measured = {"seconds": round(used.wall, 2), "memory_mb": round(used.memory)}
        if job.rule in experiments:
            place = next(iter(experiments[job.rule].writes.values()))
            labels = place.file(job.outputs[0]).labels
            yield {"kind": job.rule, **_size(plan, labels), **measured}
        else:
            kind = kind_of(job.rule, experiments)
            yield {"kind": kind, "method": job.rule, **measured}


def _size(plan: Plan, labels: dict[str, str]) -> dict[str, Any]:
    size = plan.size(labels)
    sizes = {name: round(getattr(size, name)) for name in SIZES} if size else {}
    return {"method": labels.get("method"), **sizes}


def main() -> None:
    """Write the measured jobs of the full study."""
    own = Folders()
    plan = load_plan(read_yaml(Path(DEFAULT)), Path(), (), own)
    made = measured_costs(plan, own.manuscript)
    write_tracked(MEASURED, made.to_csv(index=False).encode())


if __name__ == "__main__":
    main()
