"""One line a job, with counts and the time that is left."""

import logging
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from snakemake.logging import LoggerManager
from snakemake.settings.types import OutputSettings
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from study.pipeline.progress import Estimate, Expected, rounded

# Starts and ends of the jobs of the tiny study, seconds, with what was expected of them: two real
# runs, and one whose jobs take their processor time, two at a time.
RUNS = Path(__file__).parent / "recorded_runs"


def jobs(count: int, seconds: float = 10.0, share: float = 0.5) -> dict[int, Expected]:
    """Equal jobs that wait for none."""
    return {number: Expected(seconds, share, 0.0) for number in range(count)}


def estimate(expected: dict[int, Expected], ran: Iterable[tuple[int, float, float]]) -> Estimate:
    """After some jobs that ran, each with its start and end."""
    made = Estimate(expected)
    for job, start, end in ran:
        made.begun[job], made.ended[job] = start, end
    return made


def test_nothing_is_said_before_jobs_have_ended():
    assert Estimate({}).left(0.0) is None
    assert estimate(jobs(4), []).left(5.0) is None
    assert estimate(jobs(4), [(0, 0.0, 10.0)]).left(10.0) is None


def test_a_job_that_compiles_does_not_count_for_the_others():
    ran = [(0, 0.0, 200.0), (1, 0.0, 10.0), (2, 10.0, 20.0), (3, 20.0, 30.0), (4, 190.0, 200.0)]
    made = estimate(jobs(9, share=1.0), ran)
    assert made.left(200.0) <= 4 * 10.0


def test_what_waits_for_each_other_takes_as_long_as_the_chain():
    expected = jobs(2) | {2: Expected(10.0, 0.5, 20.0), 3: Expected(10.0, 0.5, 10.0)}
    made = estimate(expected | {4: Expected(10.0, 0.5, 0.0)}, [(0, 0.0, 10.0), (1, 0.0, 10.0)])
    assert made.left(10.0) == pytest.approx(30.0)


def test_what_runs_is_counted_by_its_rest():
    made = estimate(jobs(3, share=1.0), [(0, 0.0, 10.0), (1, 10.0, 20.0)])
    made.begun[2] = 20.0
    assert made.left(24.0) == pytest.approx(6.0)
    assert 0.0 < made.left(60.0) < 6.0


def seconds_of(words: str) -> float:
    number, unit = re.fullmatch(r"(?:less than a|about ([0-9.]+)) (minute|min|h)", words).groups()
    return float(number or 1.0) * (3600.0 if unit == "h" else 60.0)


def quotients(name: str, slower: float) -> tuple[list[float], float]:
    """Said over true seconds of a recorded run, at every job's start; share of the run before."""
    run = pd.read_csv(RUNS / f"{name}.csv")
    rows = list(run.itertuples())
    made = Estimate({job.Index: Expected(job.expected, job.share, job.after) for job in rows})
    starts = [(slower * job.start, made.begun, job.Index) for job in rows]
    ends = [(slower * job.end, made.ended, job.Index) for job in rows]
    found, silent, end = [], 0.0, slower * run.end.max()
    for now, times, job in sorted([*starts, *ends], key=lambda event: event[0]):
        if times is made.begun:
            left = made.left(now)
            if left is None:
                silent = now / end
            else:
                words = rounded(left)
                true = max(end - now, 60.0) if words.startswith("less") else end - now
                found.append(seconds_of(words) / true)
        times[job] = now
    return found, silent


@pytest.mark.parametrize(
    ("name", "slower", "most", "share", "silence"),
    [
        *(("quiet", slower, 1.5, 1.0, 0.1) for slower in (1.0, 3.0, 9.0)),
        # Other programs come and go, which nobody can know before: in `first` the load of two cores
        # rose from 2 to 25, and kernels were compiled; in `busy` it fell.
        ("first", 1.0, 1.5, 0.95, 0.25),
        ("busy", 1.0, 1.9, 0.95, 0.25),
    ],
)
def test_on_a_machine_of_any_speed_the_promise_is_kept(name, slower, most, share, silence):
    """Never more than 1.5 times what follows, nor less than 0.6; silent for a tenth of the run."""
    found, silent = quotients(name, slower)
    assert np.mean([0.6 < quotient < most for quotient in found]) >= share
    assert silent < silence
    assert len(found) > 190


def test_words():
    words = ["less than a minute", "about 1.5 min", "about 2 min", "about 9 min", "about 2.0 h"]
    assert [rounded(seconds) for seconds in (5, 80, 130, 540, 7200)] == words


@pytest.fixture
def snakemake(capsys):
    """Snakemake's logging with the plugin, as ``--logger pdrom`` sets it up."""
    logger = logging.Logger("snakemake")
    plugin = LoggerPluginRegistry().get_plugin("pdrom")
    handler = plugin.log_handler(OutputSettings(), None)
    manager = LoggerManager.__new__(LoggerManager)
    manager.settings = OutputSettings()
    handler.addFilter(manager._default_filter())
    logger.addHandler(handler)
    logger.err = lambda: capsys.readouterr().err.splitlines()
    return logger


def test_of_a_dry_run_no_job_has_a_line(capsys):
    plugin = LoggerPluginRegistry().get_plugin("pdrom")
    handler = plugin.log_handler(OutputSettings(dryrun=True), None)
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "jobid": 3, "rule_msg": "Run"}
    handler.handle(logging.makeLogRecord({"created": 0.0, **job}))
    assert capsys.readouterr().err == ""


def test_the_lines_of_a_run(snakemake):
    snakemake.info("Building DAG of jobs...")
    stats = {"fom": 10, "table": 1, "total": 11}
    snakemake.info("stats", extra={"event": LogEvent.RUN_INFO, "stats": stats})
    snakemake.info("Jobs take 11 s", extra={"expected": jobs(11, 1.0)})
    job = {"event": LogEvent.JOB_INFO, "rule_name": "fom", "reason": "Missing output files"}
    snakemake.info("", extra={**job, "jobid": 3, "rule_msg": "Full-order run of sheet"})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 3})
    snakemake.info("", extra={**job, "jobid": 5, "rule_msg": None})
    snakemake.info("", extra={"event": LogEvent.JOB_FINISHED, "job_id": 5})
    snakemake.info("", extra={**job, "jobid": 4, "rule_msg": None})
    error = {"event": LogEvent.JOB_ERROR, "rule_name": "fom", "jobid": 3}
    snakemake.error("Error in rule", extra=error)
    for fault, text in (
        ("RuleException", "CalledProcessError"),
        ("WorkflowError", "At least one job did not complete successfully."),
        ("MissingInputException", "Missing input files for rule fom"),
    ):
        snakemake.error(text, extra={"event": LogEvent.ERROR, "exception": fault})
    snakemake.warning("a warning")
    snakemake.info("Nothing to be done (all requested files are present and up to date).")
    lines = snakemake.err()
    assert [line[:7] for line in lines[:4]] == ["[ 1/11]", "[ 2/11]", "[ 3/11]", "[ 3/11]"]
    assert lines[0].endswith(" Full-order run of sheet")
    assert lines[1].endswith(" fom")
    assert lines[2].endswith(" fom   less than a minute left")
    assert lines[3].endswith(" FAILED: Full-order run of sheet")
    assert lines[4:] == [
        "Missing input files for rule fom",
        "a warning",
        "Nothing to be done (all requested files are present and up to date).",
    ]
