"""First and last steps of every run, whether ``./reproduce`` or ``snakemake`` started it."""

import atexit
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, PdromError
from study.pipeline.commandline import CommandLine, options, recall, remember
from study.pipeline.expectation import expected_seconds, tell_expectation
from study.pipeline.failures import Failures, listen
from study.pipeline.folders import Folders
from study.pipeline.fork_server import hold_pipe, start_server
from study.pipeline.full import apart
from study.pipeline.manifest import write_manifest
from study.pipeline.plan import Plan
from study.pipeline.running import (
    FOLDER,
    end_at_sigterm,
    hold,
    remove_stale_locks,
    settle_dates,
    stop_at_sigterm,
)
from study.pipeline.summary import configuration, preview, summary
from study.pipeline.targets import Rule, known

# What Snakemake compares by date.
DATED = ("results", "paper", "config", "workflow")
# Executor by which Snakemake runs the jobs of a batch on a node of a cluster.
JOBSTEP = "slurm-jobstep"


class Run:
    """The run of this process: it is alone in its folder, and says at its end what came of it."""

    def __init__(self, command: CommandLine, failures: Failures) -> None:
        self.command = command
        self.failures = failures

    @classmethod
    def begin(cls) -> "Run":
        """Be the only run in the working directory, or end the process with one line.

        A command that only looks needs no lock, so that it works beside a run.
        """
        end_at_sigterm()
        try:
            command = CommandLine.of_process()
            if command.looks_only:
                remove_stale_locks()
            else:
                hold()
                settle_dates(DATED)
                remember(command)
        except PdromError as error:
            sys.exit(f"pdrom: {error}")
        return cls(command, listen())

    def check(self, plan: Plan, folders: Folders, rules: Iterable[Rule], cores: int) -> None:
        """End the process with one line if a target or a report cannot be made.

        A dry run says at its end what it would take on so many ``cores``. ``plan``, ``folders`` and
        ``rules`` are those of the workflow.
        """
        try:
            known(plan).check(self.command.targets, list(rules))
            self._check_report(folders)
        except PdromError as error:
            sys.exit(f"pdrom: {error}")
        if self.command.plans:
            preview(expected_seconds(plan), cores)

    def _check_report(self, folders: Folders) -> None:
        asked = self.command.report and not self.command.targets
        if asked and not Path(folders.manuscript).is_file():
            last = " ".join(recall())
            hint = f"the last run was of another one: add {last}" if last else "run it first"
            raise ConfigurationError(
                f"report: this configuration has no {folders.manuscript}; {hint}"
            )

    def title(self, plan: Plan) -> str:
        """Configuration of this run, and what tells results of ``plan`` from the full study's."""
        named, words = configuration(self.command), apart(plan.study)
        return f"{named} ({words})" if words else named

    def start(self, workflow: Any, plan: Plan) -> None:
        """Start the process that jobs are forked from, unless they run on a cluster."""
        # Jobs start without a limit of their rate. For one, Snakemake starts a timer after every
        # choice among the jobs, to choose again, and each such choice starts another one: towards
        # the end of a run they take a third of a core, and the process waits for the last one.
        workflow.scheduler.job_rate_limiter = None
        stop_at_sigterm(self.failures.note_sigterm)
        say_compilation(os.environ.get("NUMBA_CACHE_DIR", ""))
        tell_expectation(workflow, plan)
        if workflow.local_exec:
            try:
                hold_pipe(FOLDER / "run.pipe")
            except OSError as error:
                sys.exit(f"pdrom: {FOLDER}/run.pipe: cannot be made ({error.strerror})")
            start_server()

    def succeed(self, plan: Plan, folders: Folders) -> None:
        """End a run whose jobs all succeeded: it says what came of ``plan`` in ``folders``."""
        try:
            self._record(plan, folders)
        except PdromError as error:
            say_last(f"pdrom: {error}\n")
        words = apart(plan.study)
        say_last(summary(self.command, folders, plan.figures, plan.table_paths, words))

    def _record(self, plan: Plan, folders: Folders) -> None:
        """Write what there is now; a run that changed nothing leaves the account of an older."""
        named = options(self.command.configfiles, self.command.settings)
        write_manifest(plan, folders, named)

    def fail(self) -> None:
        """End a run that failed or was interrupted: it says why."""
        text, status = self.failures.end()
        say_last(text)
        sys.exit(status)


def start_batch(workflow: Any) -> None:
    """Start the process that jobs of a batch are forked from, if ``workflow`` is on a node.

    Snakemake runs there twice. The first one hands the batch to the other (by `JOBSTEP`), which
    runs its jobs.
    """
    if workflow.remote_exec and JOBSTEP not in sys.argv:
        start_server()


def say_compilation(cache: str) -> None:
    """Announce that the first jobs take longer, where the folder ``cache`` has no step loop yet."""
    if not any(Path(cache).glob("dynamics*/*.nbi")):
        sys.stderr.write("pdrom: the first jobs compile kernels (once, some minutes)\n")


def say_last(text: str) -> None:
    """Write ``text`` when the process ends, after what Snakemake has still to say."""
    atexit.register(sys.stderr.write, text)
