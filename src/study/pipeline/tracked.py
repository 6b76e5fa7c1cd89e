"""Update of results stored in git, from finished studies in ``results``.

``./reproduce run python -m study.pipeline.tracked WORD`` updates, for each WORD:

costs : `config/reference/job_costs.csv` from the logs of the full and of the tiny study: for each
    kind of job, the mean processor seconds in both, and the longest time and largest memory, which
    the requests of `workflow/profiles/slurm` must cover
frozen : the fingerprint of the code, the rules and the scenes of ``config/replication.yaml``
replication : the recorded verdicts of ``config/replication.yaml``, if that is as it was frozen
rows : tables of ``config/extended.yaml`` that other studies show, too; makes them first
"""

import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.store import atomic_path, read_table
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
from study.pipeline.summary import minutes
from study.tables import declared
from study.tables.claims.claims import COMMITS, MEASURED, RECORDED, RULES
from study.tables.claims.rules import load_claims
from study.tables.kit.results import recordable

COSTS = Path("config/reference/job_costs.csv")
COLUMNS = ["kind", "seconds", "coarse_seconds", "longest_s", "memory_mb"]
KEPT = ("alternatives", "equal_error", "frontier")
WORDS = ["costs", "frozen", "replication", "rows"]
OTHERS = "config/replication.yaml"
LONG, MADE = "config/extended.yaml", Path("config/reference/recorded/made.csv")


def write_tracked(path: Path, content: bytes) -> None:
    """Write ``content`` to the git-tracked file ``path``, atomically and without a checksum."""
    with atomic_path(path, with_checksum=False) as temporary:
        temporary.write_bytes(content)


def kind_of(log: str, results: str) -> str:
    """Kind of a job: first part of the path of its ``log`` below the folder ``results``/logs."""
    return Path(log).relative_to(Path(results, "logs")).parts[0].removesuffix(".log")


def measured_costs(results: str, coarse: str) -> pd.DataFrame:
    """Return columns `COLUMNS` of each kind of job, from logs of a full and a ``coarse`` study."""

    def used(folder: str) -> Any:
        logs = {str(log): usage_of(log) for log in sorted(Path(folder, "logs").rglob("*.log"))}
        rows = [{"kind": kind_of(log, folder), **use._asdict()} for log, use in logs.items() if use]
        if not rows:
            raise PdromError(f"{folder}/logs: no job says what it used; run the study first")
        return pd.DataFrame(rows).groupby("kind")

    full = used(results)
    means = [each.processor.mean().round(2) for each in (full, used(coarse))]
    most = [full.wall.max().round(1), full.memory.max().round().astype(int)]
    return pd.concat([*means, *most], axis=1, keys=COLUMNS[1:]).reset_index()


def recorded_verdicts(claims: Path, rules: Path) -> pd.DataFrame:
    """Return what the table ``claims`` says, with its date and fingerprints of the ``rules``."""
    loaded = load_claims(rules)
    table = dated(claims, "date")[["claim", *MEASURED, "date"]]
    return table.assign(rules=[loaded[claim].fingerprint for claim in table.claim])


def code_of_replication() -> str:
    """Two fingerprints: of all code, and of rules, settings and scenes of the study `OTHERS`."""
    scenes = [read_scene(Path(), name) for name in read_yaml(Path(OTHERS))["scenes"]]
    files = [f"config/{name}.yaml" for name in ("default", "methods", "claims", "replication")]
    files += [f"config/scenes/{scene.name}.yaml" for scene in scenes]
    files += [scene.mesh.path for scene in scenes if isinstance(scene.mesh, MeshFile)]
    return f"{fingerprint(*plan()[0])[:16]} {digest(Path(), *files)}"


def replicated(claims: Path | None) -> dict[Path, pd.DataFrame]:
    """Map the files of the last replication to their content, with the verdicts in ``claims``.

    Without ``claims`` it is frozen. Raises ConfigurationError if code, rules or scenes changed.
    """
    commits, code = pd.read_csv(COMMITS, dtype=str), code_of_replication()
    last, name = commits.index[-1], commits.replication.iloc[-1]
    if claims is None:
        commits.loc[last, "code_frozen"] = code
        return {Path(COMMITS): commits}
    if (kept := commits.code_frozen[last]) != code:
        raise ConfigurationError(f"{COMMITS}: {name}: frozen is '{kept}', which now is '{code}'")
    commits.loc[last, "code_recorded"] = code
    earlier = pd.read_csv(RECORDED, dtype=str).query("replication != @name")
    verdicts = recorded_verdicts(claims, Path(RULES)).assign(replication=name)
    return {Path(RECORDED): pd.concat([earlier, verdicts]), Path(COMMITS): commits}


def dated(path: Path, column: str) -> pd.DataFrame:
    """Return the table in the file ``path``; a new ``column`` has the day the file was changed."""
    day = datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
    return read_table(path).assign(**{column: day})


def code_of_rows() -> str:
    """Fingerprint of the code on which jobs of `KEPT` depend in the long study `LONG`."""
    scenes = read_yaml(Path(LONG))[alternatives.name]["scenes"]
    effects = {place for name in scenes for place in read_scene(Path(), name).modules}
    return fingerprint(alternatives.function.__module__, *sorted(effects))[:16]


def outdated_rows() -> str | None:
    """Return a warning if the code is newer than the recorded rows of `KEPT`, else None."""
    made = pd.read_csv(MADE, dtype=str).iloc[0]
    again = f"./reproduce run python -m study.pipeline.tracked rows (last time {made.took})"
    warning = f"warning: {MADE.parent}: the code is newer than these rows; make them by {again}"
    return None if made.code == code_of_rows() else warning


def updated(word: str) -> dict[Path, pd.DataFrame]:
    """Map files to their new content, for one of `WORDS`."""
    study, tiny, replication, extended = (
        folders([f"config/{name}.yaml"], []).results
        for name in ("default", "tiny", "replication", "extended")
    )
    match word:
        case "costs":
            return {COSTS: measured_costs(study, tiny)}
        case "replication":
            return replicated(Path(TABLE.at(replication, name="claims")))
        case "frozen":
            return replicated(None)
        case "rows":
            tables = {n: dated(Path(TABLE.at(extended, name=n)), "recorded") for n in KEPT}
            used = map(usage_of, Path(extended, "logs", alternatives.name).rglob("*.log"))
            made = {"code": [code_of_rows()], "took": [minutes(sum(u.wall for u in used if u))]}
            columns = {n: recordable(declared()[n].columns) for n in KEPT}
            runs = tables[alternatives.name]  # validation motions have chosen models: `frontier`
            tables[alternatives.name] = runs[runs.motion.isin(MOTIONS)]
            rows = {Path(RECORD.format(n)): t[columns[n]] for n, t in tables.items()}
            return rows | {MADE: pd.DataFrame(made)}
    known = choices(word, WORDS)
    raise ConfigurationError(f"tracked: '{word}': unknown{known}")


if __name__ == "__main__":
    with one_line():
        if (word := " ".join(sys.argv[1:])) == "rows":
            sys.stderr.write(f"reproduce: last time this took {pd.read_csv(MADE).took[0]}\n")
            files = [TABLE.at(folders([LONG], []).results, name=name) for name in KEPT]
            if ended := subprocess.call(["./reproduce", "--configfile", LONG, "--", *files]):
                sys.exit(ended)
        for path, table in updated(word).items():
            write_tracked(path, table.to_csv(index=False).encode())
