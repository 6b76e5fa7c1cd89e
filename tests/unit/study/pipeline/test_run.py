"""Beginning of a run: its announcement, and how Snakemake chooses among the jobs."""

from types import SimpleNamespace

import pytest

from study.pipeline import run
from study.pipeline.commandline import CommandLine
from study.pipeline.failures import Failures
from study.pipeline.run import Run, say_compilation


def test_kernels_are_compiled_once(tmp_path, capsys):
    say_compilation(str(tmp_path))
    assert capsys.readouterr().err == "pdrom: the first jobs compile kernels (once, some minutes)\n"
    (tmp_path / "dynamics_1").mkdir()
    (tmp_path / "dynamics_1" / "loop.iterate_0-1.py312.nbi").touch()
    say_compilation(str(tmp_path))
    assert capsys.readouterr().err == ""


def test_choices_among_jobs_start_no_timers(monkeypatch: pytest.MonkeyPatch):
    """Snakemake's scheduler starts one after every choice where it limits the rate of jobs."""
    for name in ("stop_at_sigterm", "say_compilation", "tell_expectation"):
        monkeypatch.setattr(run, name, lambda *_: None)
    scheduler = SimpleNamespace(job_rate_limiter="1000 jobs in 20 seconds")
    workflow = SimpleNamespace(scheduler=scheduler, local_exec=False)
    begun = Run(CommandLine.parse(["--executor", "touch"]), Failures())
    begun.start(workflow, plan=None)
    assert scheduler.job_rate_limiter is None
