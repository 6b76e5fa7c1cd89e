"""Update of results stored in git: costs of jobs, verdicts for other scenes, rows of a long study.

``./reproduce run python -m study.pipeline.tracked costs`` updates `config/reference/job_costs.csv`
from the logs of the full and of the tiny study in ``results``. The file holds, for each kind of
job, the mean processor seconds in both studies, and the longest time and largest memory of a job,
which the requests of `workflow/profiles/slurm` must cover. The kind of a job is the first part of
its log's path below ``logs``: an experiment, or ``tables``, ``figures`` or ``paper``.

``./reproduce run python -m study.pipeline.tracked replication`` updates the file of the table
`replication` from the table of claims of the study ``config/replication.yaml``.

``./reproduce run python -m study.pipeline.tracked rows`` updates copies of some tables of the long
study ``config/extended.yaml``; the same tables of other studies show these recorded rows, too.
"""

import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.store import atomic_path, read_table
from study.artifact.logs import usage_of
from study.artifact.paths import TABLE
from study.artifact.reads import RECORD
from study.pipeline.commandline import one_line
from study.pipeline.folders import folders
from study.tables.claims.claims import MEASURED, RULES
from study.tables.claims.claims import RECORDED as REPLICATED
from study.tables.claims.rules import load_claims

COSTS = Path("config/reference/job_costs.csv")
COLUMNS = ["kind", "seconds", "coarse_seconds", "longest_s", "memory_mb"]
COARSE = "config/tiny.yaml"
SAMPLE = "config/replication.yaml"
LONG = "config/extended.yaml"
KEPT = ("alternatives", "winners")


def write_tracked(path: Path, content: bytes) -> None:
    """Write ``content`` to the git-tracked file ``path``, atomically and without a checksum."""
    with atomic_path(path, with_checksum=False) as temporary:
        temporary.write_bytes(content)


def kind_of(log: str, results: str) -> str:
    """Kind of a job: first part of the path of its ``log`` below the folder ``results``/logs."""
    return Path(log).relative_to(Path(results, "logs")).parts[0].removesuffix(".log")


def measured_costs(results: str, coarse: str) -> pd.DataFrame:
    """Return a row for each kind of job (see `kind_of`), with columns `COLUMNS`, from job logs.

    Raises PdromError if no log reports what a job used, for example before the first run.

    results, coarse : results folders of the full study and of a study with coarse meshes
    """
    full = _used(results).groupby("kind")
    columns = [
        full.processor.mean().round(2),
        _used(coarse).groupby("kind").processor.mean().round(2),
        full.wall.max().round(1),
        full.memory.max().round().astype(int),
    ]
    return pd.concat(columns, axis=1, keys=COLUMNS[1:]).reset_index()


def recorded_verdicts(claims: Path, rules: Path) -> pd.DataFrame:
    """Return for each claim: verdicts, measured values, date of the table, fingerprint of rules.

    Raises StorageError if the table is missing or damaged.

    claims : path of the table ``claims`` of the study ``config/replication.yaml``
    rules : path of the file with the rules of the claims
    """
    loaded = load_claims(rules)
    table = dated(claims, "date")[["claim", *MEASURED, "date"]]
    return table.assign(rules=[loaded[claim].fingerprint for claim in table.claim])


def dated(path: Path, column: str) -> pd.DataFrame:
    """Return the table in the file ``path``; a new ``column`` has the day the file was changed."""
    day = datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
    return read_table(path).assign(**{column: day})


def _used(results: str) -> pd.DataFrame:
    rows = [
        {"kind": kind_of(str(log), results), **vars(used)}
        for log in sorted(Path(results, "logs").rglob("*.log"))
        if (used := usage_of(log)) is not None
    ]
    if not rows:
        raise PdromError(f"{results}/logs: no job says what it used; run the study first")
    return pd.DataFrame(rows)


def main(words: Sequence[str]) -> None:
    """Update the results that ``words`` name: costs, replication, rows; else ConfigurationError."""
    for word in words or [""]:
        if word == "costs":
            made = {COSTS: measured_costs(folders([], []).results, folders([COARSE], []).results)}
        elif word == "replication":
            claims = TABLE.at(folders([SAMPLE], []).results, name="claims")
            made = {Path(REPLICATED): recorded_verdicts(Path(claims), Path(RULES))}
        elif word == "rows":
            results = folders([LONG], []).results
            tables = {name: Path(TABLE.at(results, name=name)) for name in KEPT}
            made = {Path(RECORD.format(name)): dated(t, "recorded") for name, t in tables.items()}
        else:
            known = choices(word, ["costs", "replication", "rows"])
            raise ConfigurationError(f"tracked: '{word}': unknown{known}")
        for path, table in made.items():
            write_tracked(path, table.to_csv(index=False).encode())


if __name__ == "__main__":
    with one_line():
        main(sys.argv[1:])
