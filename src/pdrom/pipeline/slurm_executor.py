"""Snakemake's executors for SLURM, such that a controller that is away does not lose a job.

The executor (2.8) asks for the status of all its jobs at once. Where nobody answers, because the
controller is restarted and no accounting takes its place, it drops these jobs from its list: they
go on and end, and the run waits for them for ever. A job that the controller has forgotten it
waits for as well. The executor inside of a job starts its batch by ``srun``, which fails where the
controller is away.
"""

import subprocess
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any

from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry

# Answers in a row that do not name a job before it counts as forgotten: a minute and more.
FORGOTTEN = 5
# Seconds between two questions whether the controller is back before something is submitted.
PAUSE = 5.0
QUEUE = ("squeue", "--me", "--states=all", "--noheader", "--format=%i")
PING = ("scontrol", "ping")


def install(name: str, kind: Callable[[Any], Any]) -> None:
    """Let Snakemake use a class of ``kind`` in place of the executor ``name``."""
    plugin = ExecutorPluginRegistry().get_plugin(name)
    plugin.executor = kind(plugin.executor)


def waiting(executor: Any) -> Any:
    """A class of the executor inside of a job that waits until the controller answers."""

    class Waiting(executor):  # type: ignore[misc]
        """See the module."""

        def run_job(self, job: Any) -> None:
            """Start the batch, once the controller answers."""
            wait(self.logger)
            super().run_job(job)

    return Waiting


def patient(executor: Any) -> Any:
    """A class of the executor that keeps its jobs until SLURM says how they ended.

    executor : class of the plugin, or one that reports and checks jobs as it does
    """

    class Patient(executor):  # type: ignore[misc]
        """See the module."""

        def __post_init__(self) -> None:
            self._ended: set[int] = set()
            self._unnamed: Counter[str] = Counter()
            super().__post_init__()

        def run_jobs(self, jobs: Any) -> None:
            """Submit jobs, once the controller answers."""
            wait(self.logger)
            super().run_jobs(jobs)

        def report_job_success(self, job_info: Any) -> None:
            """A job ended well."""
            self._ended.add(id(job_info))
            super().report_job_success(job_info)

        def report_job_error(self, job_info: Any, msg: str | None = None, **more: Any) -> None:
            """A job failed."""
            self._ended.add(id(job_info))
            super().report_job_error(job_info, msg=msg, **more)

        async def check_active_jobs(self, active_jobs: Any) -> AsyncIterator[Any]:
            """Every job that was not reported stays active, until SLURM has forgotten it."""
            self._ended.clear()
            async for _ in super().check_active_jobs(active_jobs):
                pass
            left = [job for job in active_jobs if id(job) not in self._ended]
            forgotten = self._forgotten(job.external_jobid for job in left)
            for job in left:
                if job.external_jobid in forgotten:
                    self._give_up(job)
                else:
                    yield job

        def _give_up(self, job: Any) -> None:
            """Of a batch Snakemake says no more than where its log is: so a line says why."""
            said = f"SLURM-job '{job.external_jobid}' failed"
            self.logger.warning(f"pdrom: SLURM does not know its job {job.external_jobid} any more")
            self.report_job_error(
                job,
                msg=f"{said}, SLURM status is: 'FORGOTTEN'",
                aux_logs=[str(job.aux["slurm_logfile"])],
            )

        def _forgotten(self, jobs: Iterable[str]) -> set[str]:
            """Jobs that the queue did not name in `FORGOTTEN` answers; accounting forgets none."""
            if self.workflow.executor_settings.status_command != "squeue":
                return set()
            known = queue()
            if known is None:
                return set()
            unnamed = {job for job in jobs if job.partition("_")[0] not in known}
            self._unnamed = Counter({job: self._unnamed[job] + 1 for job in unnamed})
            return {job for job, answers in self._unnamed.items() if answers >= FORGOTTEN}

    return Patient


def wait(logger: Any) -> None:
    """Return when the controller answers; say it if it does not at once."""
    if answers(PING):
        return
    logger.warning("pdrom: SLURM does not answer; jobs wait until it does")
    while not answers(PING):
        time.sleep(PAUSE)


def answers(command: tuple[str, ...]) -> bool:
    """Whether a command of SLURM reaches its controller."""
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def queue() -> set[str] | None:
    """Identifiers of this user's jobs, without tasks of arrays; None where nobody answers."""
    done = subprocess.run(QUEUE, capture_output=True, text=True, check=False)
    if done.returncode:
        return None
    return {line.partition("_")[0] for line in done.stdout.split()}
