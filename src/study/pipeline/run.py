"""First and last steps of every run, whether ``./reproduce`` or ``snakemake`` started it."""

import atexit
import logging
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pdrom.core.errors import ConfigurationError, PdromError
from pdrom.core.machine import Machine, Units
from pdrom.core.store import read_table, write_text
from study.artifact.paths import MACHINE
from study.pipeline.commandline import CommandLine, one_line, recall, remember
from study.pipeline.failures import Failures
from study.pipeline.folders import Folders
from study.pipeline.fork_server import hold_pipe, start_server
from study.pipeline.manifest import write_manifest
from study.pipeline.plan import Plan
from study.pipeline.progress import Expected
from study.pipeline.running import (
    FOLDER,
    end_at_sigterm,
    hold,
    remove_stale_locks,
    settle_dates,
    stop_at_sigterm,
)
from study.pipeline.scenes import Coarsen
from study.pipeline.summary import configuration, preview, summary
from study.pipeline.targets import check_targets
from study.pipeline.tracked import COLUMNS, COSTS, kind_of

RUN_TIMES = Path("config/reference/run_times.csv")


def units_of(study: str, root: Path) -> Units:
    """Units of the machine that timed a ``study``, full or tiny (`RUN_TIMES` below ``root``)."""
    row = read_table(root / RUN_TIMES, result=False).set_index("study").loc[study]
    return Units(**row[list(Units.model_fields)])


def expected_seconds(plan: Plan) -> Callable[[str], float]:
    """Function that returns the expected processor seconds of a job of a plan, given its log.

    A kind that was not measured takes the median of all. Times are scaled by the units of the
    machine that the last run of the plan has recorded.
    """
    full = plan.settings.coarsen == Coarsen()
    study, column = ("full", "seconds") if full else ("tiny", "coarse_seconds")
    table = read_table(plan.root / COSTS, COLUMNS, result=False)
    try:
        record = (plan.root / MACHINE.at(plan.results)).read_bytes()
        here = Machine.model_validate_json(record).units
    except (OSError, ValidationError):
        here = None  # before the first run, or a record of an older version
    slower = 1.0 if here is None else here.unit_s / units_of(study, plan.root).unit_s
    seconds = slower * table[column]
    known = dict(zip(table.kind, seconds, strict=True))
    usual = float(seconds.median())
    return lambda log: float(known.get(kind_of(log, plan.results), usual))


def tell_expectation(workflow: Any, plan: Plan) -> None:
    """Log what every job of Snakemake's ``workflow`` is expected to take by ``plan``.

    A job's share of this machine is 1 where it is alone, and where jobs run on a cluster.
    """
    dag, seconds_of = workflow.dag, expected_seconds(plan)
    expected: dict[int, Expected] = {}
    after: dict[Any, float] = {}
    # from the last jobs to the first, so that what follows a job is known before
    for job in reversed([job for level in dag.toposorted() for job in level]):
        if not dag.needrun(job) or not job.log:
            continue
        seconds = seconds_of(str(job.log[0]))
        share = min(job.threads / workflow.cores, 1.0) if workflow.local_exec else 1.0
        follows = max((after[other] for other in dag.depending[job] if other in after), default=0.0)
        after[job] = seconds + follows
        expected[dag.jobid(job)] = Expected(seconds, share, follows)
    total = sum(job.seconds for job in expected.values())
    logging.getLogger("snakemake.logging").info(
        f"Jobs take {total:.0f} s one by one where they were measured.",
        extra={"expected": expected},
    )


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
        with one_line():
            command = CommandLine.parse(sys.argv[1:])
            if command.looks_only:
                remove_stale_locks()
            else:
                hold()
                settle_dates(DATED)
                remember(command)
        failures = Failures()
        logging.getLogger("snakemake.logging").addHandler(failures)
        return cls(command, failures)

    def check(self, plan: Plan, folders: Folders, rules: Iterable[Any], cores: int) -> None:
        """Check targets and report; a dry run says at its end what it would take on ``cores``.

        ``plan``, ``folders`` and Snakemake's ``rules`` are those of the workflow.

        Raises
        ------
        ConfigurationError
            A target or the report cannot be made.
        """
        check_targets(plan, self.command.targets, list(rules))
        reports = self.command.report and not self.command.targets
        if reports and not Path(folders.manuscript).is_file():
            last = " ".join(recall())
            hint = f"the last run was of another one: add {last}" if last else "run it first"
            raise ConfigurationError(
                f"report: this configuration has no {folders.manuscript}; {hint}"
            )
        if self.command.plans:
            preview(expected_seconds(plan), cores)

    def title(self, plan: Plan) -> str:
        """Configuration of this run, and what tells results of ``plan`` from the full study's."""
        named, words = configuration(self.command), plan.study.apart
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

    def succeed(self, workflow: Any, plan: Plan, folders: Folders) -> None:
        """End a run whose jobs all succeeded: it says what came of ``plan`` in ``folders``."""
        # late: a plan needs nothing of it
        from study.pipeline.inventory import CONTENTS, contents

        try:
            if not self.command.targets:
                text = contents(self.command, workflow.dag, folders)
                write_text(text, CONTENTS.at(folders.results))
            write_manifest(plan, folders, self.command.configuration)
        except PdromError as error:
            say_last(f"pdrom: {error}\n")
        say_last(summary(self.command, folders, plan.figures, plan.table_paths, plan.study.apart))

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
