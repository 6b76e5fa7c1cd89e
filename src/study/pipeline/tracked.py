"""Update results that are stored in git, from finished studies in ``results``.

``./reproduce run python -m study.pipeline.tracked WORD`` updates, for each WORD:

costs : `config/reference/job_costs.csv` from the logs of the full and of the tiny study: for each
    kind of job, its mean processor seconds in each of the two studies, and its longest time and
    largest memory, which the requests of `workflow/profiles/slurm` must cover
frozen : fingerprint of the code, and of the rules and scenes of ``config/replication.yaml``
replication : verdicts of ``config/replication.yaml``; refused if this fingerprint has changed
rows : tables of ``config/extended.yaml`` that other studies show, too; they are computed first
"""

import argparse
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.errors import ConfigurationError
from pdrom.core.store import read_table, write_text
from pdrom.core.yamlfile import read_yaml
from pdrom.model.held_out import MOTIONS
from pdrom.model.mesh.config import MeshFile
from study.artifact.logs import usage_of
from study.artifact.paths import TABLE
from study.artifact.planned import plan
from study.artifact.reads import RECORD
from study.experiments.alternatives.experiment import alternatives
from study.pipeline.commandline import one_line
from study.pipeline.fingerprint import digest, fingerprint
from study.pipeline.folders import folders
from study.pipeline.scenes import read_scene
from study.tables import declared
from study.tables.claims.claims import COMMITS, MEASURED, RECORDED, RULES
from study.tables.claims.rules import load_claims
from study.tables.kit.results import recordable

COSTS = "config/reference/job_costs.csv"
COLUMNS = ["kind", "seconds", "coarse_seconds", "longest_s", "memory_mb"]
KEPT = ("alternatives", "equal_error", "frontier")
FULL, TINY = "config/default.yaml", "config/tiny.yaml"
OTHERS, LONG = "config/replication.yaml", "config/extended.yaml"
MADE = "config/reference/recorded/made.csv"


def kind_of(log: str, results: str) -> str:
    """Return the kind of a job: first part of the path of its ``log`` in ``results``/logs."""
    return Path(log).relative_to(Path(results, "logs")).parts[0].removesuffix(".log")


def costs(results: str, coarse: str) -> pd.DataFrame:
    """Return a table with `COLUMNS`, from the logs of a full study and of a ``coarse`` study."""

    def used(folder: str) -> Any:
        logs = {str(log): usage_of(log) for log in sorted(Path(folder, "logs").rglob("*.log"))}
        rows = [{"kind": kind_of(log, folder), **use._asdict()} for log, use in logs.items() if use]
        return pd.DataFrame(rows).groupby("kind")

    full = used(results)
    means = [each.processor.mean().round(2) for each in (full, used(coarse))]
    most = [full.wall.max().round(1), full.memory.max().round().astype(int)]
    return pd.concat([*means, *most], axis=1, keys=COLUMNS[1:]).reset_index()


def verdicts(claims: Path) -> pd.DataFrame:
    """Return the verdicts in the table ``claims``, its date, and the fingerprints of its rules."""
    table, rules = dated(claims, "date")[["claim", *MEASURED, "date"]], load_claims(Path(RULES))
    return table.assign(rules=[rules[claim].fingerprint for claim in table.claim])


def code_of_replication() -> str:
    """Return fingerprints of all code, and of rules, settings and scenes of the study `OTHERS`."""
    scenes = [read_scene(Path(), name) for name in read_yaml(Path(OTHERS))["scenes"]]
    files = [f"config/{name}.yaml" for name in ("default", "methods", "claims", "replication")]
    files += [f"config/scenes/{scene.name}.yaml" for scene in scenes]
    files += [scene.mesh.path for scene in scenes if isinstance(scene.mesh, MeshFile)]
    return f"{fingerprint(*plan())[:16]} {digest(Path(), *files)}"


def replication(claims: Path | None) -> dict[str, pd.DataFrame]:
    """Map files about the last replication to their content, with the verdicts in ``claims``.

    Record only fingerprints if ``claims`` is None, or else raise ConfigurationError if they differ.
    """
    commits, code = pd.read_csv(COMMITS, dtype=str), code_of_replication()
    last, name = commits.index[-1], commits.replication.iloc[-1]
    commits.loc[last, "code_recorded" if claims else "code_frozen"] = code
    if not claims:
        return {COMMITS: commits}
    if (kept := commits.code_frozen[last]) != code:
        raise ConfigurationError(f"{COMMITS}: {name}: the frozen code '{kept}' is now '{code}'")
    earlier = pd.read_csv(RECORDED, dtype=str).query("replication != @name")
    found = verdicts(claims).assign(replication=name)
    return {RECORDED: pd.concat([earlier, found]), COMMITS: commits}


def dated(path: Path, column: str) -> pd.DataFrame:
    """Return the table in ``path``, with the day of the file's last change in a new ``column``."""
    day = datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
    return read_table(path).assign(**{column: day})


def rows(results: str) -> dict[str, pd.DataFrame]:
    """Map the files of recorded rows, and `MADE`, to their content from the long study."""
    tables = {n: dated(Path(TABLE.at(results, name=n)), "recorded") for n in KEPT}
    runs = tables[alternatives.name]  # drop validation trajectories: `frontier` has used them
    tables[alternatives.name] = runs[runs.motion.isin(MOTIONS)]
    made = {MADE: pd.DataFrame({"code": [code_of_rows()]})}
    return made | {
        RECORD.format(n): t[recordable(declared()[n].columns)] for n, t in tables.items()
    }


def code_of_rows() -> str:
    """Return the fingerprint of the code that makes the tables `KEPT` in the study `LONG`."""
    scenes = read_yaml(Path(LONG))[alternatives.name]["scenes"]
    effects = {place for name in scenes for place in read_scene(Path(), name).modules}
    return fingerprint(alternatives.function.__module__, *sorted(effects))[:16]


def outdated_rows() -> str | None:
    """Return a warning if the code is newer than the recorded rows of `KEPT`, else None."""
    if pd.read_csv(MADE, dtype=str).code[0] == code_of_rows():
        return None
    again = "./reproduce run python -m study.pipeline.tracked rows"
    return f"warning: {MADE}: the code is newer than the recorded rows; update them by {again}"


def updated(word: str) -> dict[str, pd.DataFrame]:
    """Map files to their new content; the docstring of this module explains each ``word``."""
    full, tiny, others, long = (folders([f], []).results for f in (FULL, TINY, OTHERS, LONG))
    match word:
        case "costs":
            return {COSTS: costs(full, tiny)}
        case "rows":
            return rows(long)
    return replication(None if word == "frozen" else Path(TABLE.at(others, name="claims")))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="study.pipeline.tracked")
    parser.add_argument("word", choices=["costs", "frozen", "replication", "rows"])
    word = parser.parse_args().word
    with one_line():
        if word == "rows":
            files = [TABLE.at(folders([LONG], []).results, name=name) for name in KEPT]
            if ended := subprocess.call(["./reproduce", "--configfile", LONG, "--", *files]):
                sys.exit(ended)
        for path, table in updated(word).items():
            write_text(table.to_csv(index=False), path, with_checksum=False)
