"""Begin and end a run of the workflow, which ``./reproduce`` or ``snakemake`` has started."""

import atexit
import json
import logging
import os
import signal
import sys
from collections.abc import Callable
from typing import Any

from snakemake.scheduling.job_scheduler import JobScheduler

from pdrom.core.errors import PdromError
from pdrom.core.store import read_table, write_text
from pdrom.core.store.checksum import move_aside
from snakemake_logger_plugin_pdrom import rounded
from study.artifact import planned
from study.pipeline import running
from study.pipeline.commandline import CommandLine, one_line, remember
from study.pipeline.failures import Failures
from study.pipeline.fingerprint import memory
from study.pipeline.fork_server import start_server
from study.pipeline.manifest import write_manifest
from study.pipeline.plan import Plan
from study.pipeline.scenes import Coarsen
from study.pipeline.signals import handle, leave
from study.pipeline.summary import CONTENTS, contents, summary
from study.pipeline.targets import check_targets
from study.pipeline.tracked import COLUMNS, COSTS, kind_of
from study.pipeline.unfit import MISSING, UNUSUAL, faults, force


def expected_seconds(plan: Plan) -> Callable[[str], float]:
    """Return a function that maps the path of a job's log to its expected processor seconds.

    They are the mean over measured jobs of this kind, or else the median over all kinds.
    """
    full = plan.study.settings.coarsen == Coarsen()
    table = read_table(plan.study.root / COSTS, COLUMNS, result=False)
    seconds = table.seconds if full else table.coarse_seconds
    known = dict(zip(table.kind, seconds, strict=True))
    usual = float(seconds.median())
    return lambda log: float(known.get(kind_of(log, plan.results), usual))


def expected_work(workflow: Any, plan: Plan) -> dict[int, float]:
    """Map the number of each job that ``workflow`` runs to its expected seconds times its cores.

    Rules without a log only collect targets and take no time.
    """
    dag, seconds_of = workflow.dag, expected_seconds(plan)
    jobs = [job for job in dag.jobs if dag.needrun(job) and job.log]
    return {dag.jobid(job): seconds_of(str(job.log[0])) * job.threads for job in jobs}


class Run:
    """A run of the workflow in this process: lock of the folder, fork server, last messages."""

    def __init__(self) -> None:
        """Lock the working directory if jobs will run; end the process if it is locked already."""
        handle(leave)
        JobScheduler.exit_gracefully = staticmethod(leave)
        with one_line():
            self.command = CommandLine(sys.argv[1:])
            if not self.command.looks_only:
                running.hold()
                remember(self.command)
        atexit.register(memory().save)
        self.failures = Failures()
        logging.getLogger("snakemake.logging").addHandler(self.failures)

    def check(self, plan: Plan, workflow: Any, cores: int) -> None:
        """Check that requested targets can be made; a dry run also prints the expected time.

        Results that do not fit ``plan`` (see `faults`) are made again; a run first renames those
        that are damaged or copied. Raises ConfigurationError if a target cannot be made.
        """
        check_targets(plan, self.command.targets, list(workflow.rules))
        found = faults(plan, self.command.targets) if self.command.makes else {}
        for path, fault in found.items():
            if fault in UNUSUAL:
                aside = "" if fault == MISSING or self.command.plans else move_aside(path)
                sys.stderr.write(f"pdrom: {path}: {fault}{aside}; it is made again\n")
        force(workflow, found)
        if self.command.plans:

            def forecast() -> None:
                if work := expected_work(workflow, plan):
                    seconds, s = sum(work.values()) / cores, "s" * (cores > 1)
                    sys.stdout.write(f"pdrom: expected time: {rounded(seconds)}, {cores} core{s}\n")

            atexit.register(forecast)

    def start(self, workflow: Any, plan: Plan) -> None:
        """Log the expected times of jobs, and start the fork server if jobs run on this machine."""
        # If Snakemake limits the rate of starts, each selection of jobs starts a timer, which
        # selects again: these timers use a third of a core, and the process waits until they end.
        workflow.scheduler.job_rate_limiter = None
        memory().save()  # save now, because a signal may end the run at any time
        expected = expected_work(workflow, plan)
        logging.getLogger("snakemake.logging").info(
            f"Jobs took {sum(expected.values()):.0f} s on one core of the machine that timed them.",
            extra={"expected": expected},
        )
        with one_line():
            write_text(json.dumps(planned.kept()), planned.PLAN, with_checksum=False)
        os.environ[planned.KEPT] = str(planned.PLAN.absolute())
        if workflow.local_exec:
            start_server()
        else:
            handle(signal.default_int_handler)  # with this handler, Snakemake cancels its jobs

    def succeed(self, plan: Plan) -> None:
        """End a successful run: write overview and manifest, and print the summary."""
        handle(leave)
        try:
            if not self.command.targets:
                write_text(contents(self.command, plan), CONTENTS.at(plan.results))
            write_manifest(plan, self.command.configuration)
        except PdromError as error:
            atexit.register(sys.stderr.write, f"pdrom: {error}\n")
        atexit.register(sys.stderr.write, summary(self.command, plan))

    def fail(self) -> None:
        """End a failed run: print the causes of the failures."""
        atexit.register(sys.stderr.write, self.failures.text())


def start_batch(workflow: Any) -> None:
    """Start the fork server for a batch of jobs, if ``workflow`` runs on a node of a cluster."""
    # Snakemake runs twice on a node: the first process runs no job and only starts the second
    if workflow.remote_exec and "slurm-jobstep" not in sys.argv:
        start_server()
