"""Runs on a cluster by SLURM: its executor, and a check that some node can take every job.

Snakemake's executor for SLURM is not among the packages that every run needs. It is installed from
`requirements-cluster.lock`, with its hashes, when a command asks for it first.
"""

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pdrom.core.errors import PdromError
from pdrom.core.yamlfile import read_yaml

EXECUTOR = "slurm"
JOBSTEP = "slurm-jobstep"
PLUGIN = "snakemake_executor_plugin_slurm"
LOCK = "requirements-cluster.lock"
# Name of each node's partition (with a star if it is the default one), processors, memory, limit.
SINFO = ("sinfo", "--noheader", "--Node", "--format=%P|%c|%m|%l")
UNLIMITED = ("infinite", "UNLIMITED", "n/a")


class ClusterError(PdromError):
    """The cluster cannot run what is asked of it."""


@dataclass(frozen=True)
class Node:
    """Limits of a node; ``minutes`` is None where the partition has no limit."""

    partition: str
    default: bool
    processors: int
    memory_mb: int
    minutes: int | None

    @classmethod
    def parse(cls, line: str) -> "Node":
        """One line of `SINFO`."""
        name, processors, memory, limit = line.strip().split("|")
        return cls(
            partition=name.removesuffix("*"),
            default=name.endswith("*"),
            processors=int(processors.rstrip("+")),
            memory_mb=int(memory.rstrip("+")),
            minutes=_minutes(limit),
        )


@dataclass(frozen=True)
class Demand:
    """Request of a job; ``partition`` is None for the default one."""

    job: str
    partition: str | None
    processors: int
    memory_mb: int
    minutes: int

    def obstacle(self, nodes: Sequence[Node]) -> str | None:
        """Reason why none of ``nodes`` takes the job, with the remedy; None if one does."""
        own = [n for n in nodes if (n.partition == self.partition if self.partition else n.default)]
        if not own:
            known = ", ".join(dict.fromkeys(node.partition for node in nodes))
            wanted = (
                f"no partition '{self.partition}'" if self.partition else "no default partition"
            )
            return f"{wanted} (there are: {known}); name one: slurm_partition=NAME"
        limits = [node.minutes for node in own if node.minutes is not None]
        asked = (
            ("processors", self.processors, max(n.processors for n in own), "lower --cores"),
            ("MB of memory", self.memory_mb, max(n.memory_mb for n in own), "choose larger nodes"),
            ("minutes", self.minutes, max(limits, default=self.minutes), "choose a longer queue"),
        )
        for unit, wanted_amount, most, remedy in asked:
            if wanted_amount > most:
                return (
                    f"job {self.job} asks for {wanted_amount} {unit}, partition "
                    f"{own[0].partition} has at most {most}: it would wait for ever; {remedy}"
                )
        return None


def install_executor(arguments: Sequence[str]) -> None:
    """Install the executor if ``arguments`` ask for it and it is not there, then start again.

    Raises
    ------
    ClusterError
        If the packages cannot be installed.
    """
    if importlib.util.find_spec(PLUGIN) or asked_executor(arguments) != EXECUTOR:
        return
    sys.stderr.write(f"reproduce: installing Snakemake's executor for SLURM from {LOCK} (once)\n")
    pip = ["-m", "pip", "install", "--quiet", "--require-hashes", "--no-deps"]
    pip += ["--only-binary", ":all:", "--disable-pip-version-check", "-r", LOCK]
    done = subprocess.run([sys.executable, *pip], capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise ClusterError(f"{LOCK}: the packages cannot be installed: {last}")
    os.execv(sys.executable, [sys.executable, "-m", "pdrom.pipeline.front", *arguments])


def asked_executor(arguments: Sequence[str]) -> str | None:
    """Executor that ``arguments`` name, or their profile; Snakemake's own parser may refuse it.

    It knows only executors that are installed.
    """
    # late: Snakemake's jobs import this module, too, and need no parser
    from snakemake.cli import get_profile_dir

    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("-e", "--executor")
    parser.add_argument("--profile", nargs="+", default=[])
    found, _ = parser.parse_known_args(list(arguments))
    executor: str | None = found.executor
    for profile in found.profile:
        file = get_profile_dir(profile)
        content = read_yaml(Path(file[1])) if file else None
        if executor is None and isinstance(content, dict):
            executor = content.get("executor")
    return executor


def check_nodes(dag: Any) -> None:
    """Compare jobs of Snakemake's ``dag`` with the nodes; ClusterError for one that none takes.

    SLURM lets such a job wait without a word.
    """
    nodes = _nodes()
    for demand in _demands(dag):
        if obstacle := demand.obstacle(nodes):
            raise ClusterError(f"cluster: {obstacle}")


def _demands(dag: Any) -> Iterable[Demand]:
    for job in dag.needrun_jobs():
        if job.is_local:
            continue
        whole = dag.get_job_group(job) or job
        asked = whole.resources
        yield Demand(
            job.rule.name,
            asked.get("slurm_partition"),
            int(asked.get("_cores", 1)),
            int(asked.get("mem_mb", 0)),
            int(asked.get("runtime", 0)),
        )


def _nodes() -> list[Node]:
    if shutil.which(SINFO[0]) is None:
        raise ClusterError("cluster: there is no sinfo here: is this a login node of a SLURM?")
    done = subprocess.run(SINFO, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ClusterError(f"cluster: sinfo: {done.stderr.strip() or done.returncode}")
    return [Node.parse(line) for line in done.stdout.splitlines() if line.strip()]


def _minutes(limit: str) -> int | None:
    """Minutes of SLURM's [days-]hours:minutes:seconds, or minutes:seconds."""
    if limit in UNLIMITED:
        return None
    days, _, clock = limit.rpartition("-")
    hours, minutes, _ = ([0, 0, 0] + [int(part) for part in clock.split(":")])[-3:]
    return int(days or 0) * 1440 + hours * 60 + minutes
