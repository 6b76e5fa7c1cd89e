"""The check of a cluster's nodes, and when the executor is installed."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from pdrom.pipeline import cluster
from pdrom.pipeline.cluster import ClusterError, Demand, Node, asked_executor, check_nodes
from places import ROOT

PROFILE = str(ROOT / "workflow" / "profiles" / "slurm")
NODES = [
    Node("short", default=True, processors=4, memory_mb=8000, minutes=60),
    Node("long", default=False, processors=64, memory_mb=500_000, minutes=None),
]


@pytest.mark.parametrize(
    ("line", "node"),
    [
        ("main*|2|24105|4:00:00", Node("main", True, 2, 24105, 240)),
        ("gpu|128+|500000+|2-12:30:00", Node("gpu", False, 128, 500_000, 3630)),
        ("a|1|10|30:00", Node("a", False, 1, 10, 30)),
        ("all|4|1000|infinite", Node("all", False, 4, 1000, None)),
    ],
)
def test_what_sinfo_says_of_a_node(line: str, node: Node) -> None:
    assert Node.parse(line) == node


def test_a_job_that_fits_is_let_pass() -> None:
    assert Demand("fom", None, 4, 8000, 60).obstacle(NODES) is None
    assert Demand("fom", "long", 64, 9000, 100_000).obstacle(NODES) is None


@pytest.mark.parametrize(
    ("demand", "words"),
    [
        (Demand("timing", None, 8, 10, 1), ("timing", "8 processors", "at most 4", "--cores")),
        (Demand("online", None, 1, 9000, 1), ("online", "9000 MB", "at most 8000")),
        (Demand("fom", None, 1, 10, 61), ("fom", "61 minutes", "at most 60")),
        (Demand("fom", "gpu", 1, 10, 1), ("no partition 'gpu'", "short, long")),
    ],
)
def test_a_job_that_no_node_takes_is_named(demand: Demand, words: tuple[str, ...]) -> None:
    obstacle = demand.obstacle(NODES)
    assert obstacle is not None
    assert all(word in obstacle for word in words)


def test_without_a_default_partition_one_must_be_named() -> None:
    obstacle = Demand("fom", None, 1, 1, 1).obstacle([NODES[1]])
    assert obstacle is not None
    assert "slurm_partition=NAME" in obstacle


class Dag:
    """Jobs of Snakemake, as far as the check looks at them."""

    def __init__(self, *jobs: SimpleNamespace) -> None:
        self.jobs = jobs

    def needrun_jobs(self) -> tuple[SimpleNamespace, ...]:
        return self.jobs

    def get_job_group(self, job: SimpleNamespace) -> SimpleNamespace | None:
        return job.group


def job(name: str, group: SimpleNamespace | None = None, **asked: object) -> SimpleNamespace:
    rule = SimpleNamespace(name=name)
    return SimpleNamespace(rule=rule, resources=asked, is_local=False, group=group)


def test_the_resources_of_a_group_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_nodes", lambda: NODES)
    together = SimpleNamespace(resources={"_cores": 6, "mem_mb": 10, "runtime": 1})
    check_nodes(Dag(job("fom", _cores=1, mem_mb=10, runtime=1)))
    with pytest.raises(ClusterError, match="job fom asks for 6 processors"):
        check_nodes(Dag(job("fom", together, _cores=1, mem_mb=10, runtime=1)))


def test_without_slurm_the_check_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ClusterError, match="no sinfo"):
        check_nodes(Dag())


@pytest.mark.parametrize(
    ("arguments", "executor"),
    [
        ([], None),
        (["-n", "x.pdf"], None),
        (["--executor", "slurm", "--slurm-no-account"], "slurm"),
        (["-e", "local"], "local"),
        (["--profile", PROFILE, "--", "x.pdf"], "slurm"),
        (["--profile", PROFILE, "--executor", "local"], "local"),
    ],
)
def test_the_executor_is_that_of_the_command_or_its_profile(
    arguments: list[str], executor: str | None
) -> None:
    assert asked_executor(arguments) == executor


def test_packages_that_cannot_be_installed_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def pip(command: list[str], **options: object) -> subprocess.CompletedProcess[str]:
        assert "--require-hashes" in command
        return subprocess.CompletedProcess(command, 1, "", "warning\nERROR: no network\n")

    monkeypatch.setattr(cluster.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(subprocess, "run", pip)
    with pytest.raises(ClusterError, match=r"requirements-cluster.lock.*no network"):
        cluster.install_executor(["--executor", "slurm"])


def test_nothing_is_installed_unless_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(subprocess, "run", lambda *a, **k: pytest.fail("something was started"))
    cluster.install_executor(["-n"])
