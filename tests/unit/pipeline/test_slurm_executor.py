"""The executor that keeps its jobs while nobody says how they are."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from snakemake.cli import get_argument_parser
from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry

from pdrom.pipeline import slurm_executor
from pdrom.pipeline.failures import cause
from pdrom.pipeline.slurm_executor import FORGOTTEN, install, patient, waiting


@dataclass
class Job:
    """A submitted job."""

    external_jobid: str

    @property
    def aux(self) -> dict[str, str]:
        """What the plugin notes of a job."""
        return {"slurm_logfile": f"{self.external_jobid}.log"}


class Executor:
    """The plugin's, as far as it matters here: jobs of an unanswered question are not kept."""

    def __init__(self, status_command: str = "squeue") -> None:
        settings = SimpleNamespace(status_command=status_command)
        self.workflow = SimpleNamespace(executor_settings=settings)
        self.logger = SimpleNamespace(warning=lambda text: self.said.append(text))
        self.said: list[str] = []
        self.status: dict[str, str] | None = {}
        self.reported: dict[str, str | None] = {}
        self.submitted: list[Any] = []
        self.__post_init__()

    def __post_init__(self) -> None:
        """For the classes above."""

    def run_jobs(self, jobs: list[Any]) -> None:
        self.submitted += jobs

    def run_job(self, job: Any) -> None:
        self.submitted.append(job)

    def report_job_success(self, job_info: Job) -> None:
        self.reported[job_info.external_jobid] = None

    def report_job_error(self, job_info: Job, msg: str | None = None, **more: Any) -> None:
        self.reported[job_info.external_jobid] = msg
        self.logs = more.get("aux_logs")

    async def check_active_jobs(self, active_jobs: list[Job]) -> AsyncIterator[Job]:
        for job in active_jobs if self.status is not None else ():
            status = self.status.get(job.external_jobid)
            if status == "COMPLETED":
                self.report_job_success(job)
            elif status == "FAILED":
                self.report_job_error(job, msg="no")
            else:
                yield job


def kept(executor: Any, jobs: list[Job]) -> list[Job]:
    """Jobs that are still active after a check."""

    async def check() -> list[Job]:
        return [job async for job in executor.check_active_jobs(jobs)]

    return asyncio.run(check())


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """What the queue says: jobs that it knows."""
    found: set[str] = set()
    monkeypatch.setattr(slurm_executor, "queue", lambda: found)
    return found


def test_jobs_of_an_unanswered_question_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal ones, too; the plugin's own class loses them."""
    monkeypatch.setattr(slurm_executor, "queue", lambda: None)
    jobs, executor = [Job("1"), Job("2"), Job("2")], patient(Executor)()
    executor.status = None
    for _ in range(2 * FORGOTTEN):
        assert kept(executor, jobs) == jobs
    plain = Executor()
    plain.status = None
    assert kept(plain, jobs) == []


def test_ended_jobs_are_reported_once(known: set[str]) -> None:
    known |= {"1", "2", "3"}
    jobs, executor = [Job("1"), Job("2"), Job("3")], patient(Executor)()
    executor.status = {"1": "COMPLETED", "2": "FAILED", "3": "RUNNING"}
    assert kept(executor, jobs) == [jobs[2]]
    assert executor.reported == {"1": None, "2": "no"}


def test_a_job_that_slurm_has_forgotten_fails(known: set[str], tmp_path) -> None:
    """Only after several answers in a row that do not name it."""
    known.add("7")
    jobs, executor = [Job("7"), Job("8_1")], patient(Executor)()
    for _ in range(FORGOTTEN - 1):
        assert kept(executor, jobs) == jobs
    known.add("8")
    assert kept(executor, jobs) == jobs
    known.remove("8")
    for _ in range(FORGOTTEN - 1):
        assert kept(executor, jobs) == jobs
    assert kept(executor, jobs) == [jobs[0]]
    assert cause(executor.reported["8_1"], tmp_path) == "SLURM says forgotten"
    assert executor.logs == ["8_1.log"]
    assert "its job 8_1" in executor.said[-1]


def test_accounting_forgets_nothing(known: set[str]) -> None:
    executor = patient(Executor)("sacct")
    for _ in range(2 * FORGOTTEN):
        assert kept(executor, [Job("7")]) == [Job("7")]


def test_nothing_is_submitted_while_the_controller_is_away(monkeypatch: pytest.MonkeyPatch) -> None:
    later = iter([False, False, True])
    executor = patient(Executor)()
    monkeypatch.setattr(slurm_executor, "answers", lambda command: next(later))
    monkeypatch.setattr(slurm_executor.time, "sleep", lambda pause: executor.submitted.clear())
    executor.run_jobs(["a", "b"])
    assert executor.submitted == ["a", "b"]
    assert len(executor.said) == 1
    assert next(later, None) is None


def test_no_batch_is_started_while_the_controller_is_away(monkeypatch: pytest.MonkeyPatch) -> None:
    later = iter([False, False, True])
    executor = waiting(Executor)()
    monkeypatch.setattr(slurm_executor, "answers", lambda command: next(later))
    monkeypatch.setattr(slurm_executor.time, "sleep", lambda pause: executor.submitted.clear())
    executor.run_job("a")
    assert executor.submitted == ["a"]
    assert len(executor.said) == 1


def test_the_queue_is_that_of_this_user(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    """By a squeue that answers, and by one that does not."""
    program = tmp_path / "squeue"
    program.write_text('#!/bin/sh\n[ "$1" = --me ] && printf "12\\n13_4\\n13_[5-9]\\n"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert slurm_executor.queue() == {"12", "13"}
    program.write_text("#!/bin/sh\nexit 1\n")
    assert slurm_executor.queue() is None


def test_snakemake_gets_the_patient_class(monkeypatch: pytest.MonkeyPatch) -> None:
    get_argument_parser()  # Snakemake collects its plugins for it
    plugin = ExecutorPluginRegistry().get_plugin("local")
    monkeypatch.setattr(plugin, "executor", Executor)
    install("local", patient)
    assert ExecutorPluginRegistry().get_plugin("local").executor.__mro__[1] is Executor
