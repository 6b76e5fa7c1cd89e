"""Jobs that are forked from a server behave like scripts of a new interpreter."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from snakemake.script import PythonScript

from study.pipeline import fork_server
from study.pipeline import run as running
from study.pipeline.fork_server import METHOD, start_server

pytestmark = pytest.mark.skipif(METHOD != "forkserver", reason="no safe forks on this platform")

# A process that starts the server, lets Snakemake run the scripts of its arguments one after the
# other, and says how they end.
OWNER = """
import subprocess, sys
from types import SimpleNamespace
from snakemake.script import PythonScript
from study.pipeline.fork_server import start_server
start_server("fractions")
for script in sys.argv[1:]:
    try:
        PythonScript.execute_script(SimpleNamespace(container_img=None), script)
        print("ended 0", flush=True)
    except subprocess.CalledProcessError as error:
        print("ended", error.returncode, flush=True)
"""


def run(*scripts: str, owner: str = OWNER, **options) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", owner, *scripts],
        capture_output=True, text=True, check=True, **options,
    )  # fmt: skip


def start(*scripts: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", OWNER, *scripts], stdout=subprocess.PIPE, text=True
    )


def script(folder: Path, text: str, name: str = "a script é.py") -> str:
    """Path of a script with this ``text``."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_job_has_the_environment_of_the_run_and_nothing_of_another_job(tmp_path):
    code = """
import os, sys
print(os.getcwd(), os.environ["COLOUR"], sys.argv, sys.path[0], sys.stdin.read())
print(__name__, hasattr(sys.modules["fractions"], "mark"), flush=True)
sys.modules["fractions"].mark = 1
print("a warning", file=sys.stderr)
"""
    path = script(tmp_path, code)
    done = run(path, path, cwd="/", env={**os.environ, "COLOUR": "blue"}, stdin=subprocess.DEVNULL)
    said = [f"/ blue {[path]} {tmp_path} ", "__main__ False", "ended 0"]
    assert done.stdout.splitlines() == said * 2
    assert done.stderr == "a warning\n" * 2


def test_a_forked_job_has_the_registered_types_of_numba(tmp_path):
    """Otherwise each process that loads a compiled function would import these types again."""
    code = """
import sys
known = set(sys.modules)
from numba.core.registry import cpu_target
cpu_target.typing_context.refresh()
cpu_target.target_context.refresh()
print(sorted(set(sys.modules) - known))
"""
    done = run(script(tmp_path, code), owner=OWNER.replace('"fractions"', ""))
    assert done.stdout.splitlines() == ["[]", "ended 0"]


def test_a_run_gets_the_exit_status_of_a_job(tmp_path):
    codes = [
        "import sys; sys.exit(3)",
        "import sys; sys.exit('pdrom: no')",
        "1 / 0",
        "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
        "import os; os._exit(7)",
    ]
    done = run(*(script(tmp_path, code, f"{i}.py") for i, code in enumerate(codes)))
    assert done.stdout.split() == [
        "ended",
        "3",
        "ended",
        "1",
        "ended",
        "1",
        "ended",
        "-9",
        "ended",
        "7",
    ]
    assert done.stderr.startswith("pdrom: no\n")
    assert done.stderr.endswith("ZeroDivisionError: division by zero\n")


def test_a_successful_job_waits_for_its_threads_and_writes_its_output(tmp_path):
    code = f"""
import sys, threading
begun = threading.Event()
def work():
    begun.wait()
    open({str(tmp_path / "thread")!r}, "w").write("done")
threading.Thread(target=work).start()
sys.stdout.write("x" * 5000 + "\\n")
begun.set()
"""
    done = run(script(tmp_path, code))
    assert done.stdout == f"{'x' * 5000}\nended 0\n"
    assert (tmp_path / "thread").read_text() == "done"


# A job that starts a process: each reports that it runs, and holds a pipe that closes when
# they have ended.
WAITS = """
import os, subprocess
subprocess.run("echo $PPID; sleep 600", shell=True)
"""


def test_no_job_outlives_the_run(tmp_path):
    """The pipe closes, although the process that the job has started is unknown to the run."""
    owner = start(script(tmp_path, WAITS))
    owner.stdout.readline()
    owner.kill()
    assert owner.communicate() == ("", None)


def test_a_job_ends_with_its_server_and_the_next_one_has_another_server(tmp_path):
    owner = start(script(tmp_path, WAITS), script(tmp_path, "print('next')", "next.py"))
    job = int(owner.stdout.readline())
    psutil.Process(job).parent().kill()
    assert owner.communicate() == ("ended 255\nnext\nended 0\n", None)


def test_snakemake_starts_scripts_in_containers(monkeypatch):
    ran = []
    monkeypatch.setattr(fork_server, "METHOD", "spawn")
    monkeypatch.setattr(PythonScript, "execute_script", lambda *given: ran.append(given))
    start_server()
    contained = SimpleNamespace(container_img="pdrom.sif")
    PythonScript.execute_script(contained, "a.py")
    assert ran == [(contained, "a.py", False)]


@pytest.mark.parametrize(
    ("remote", "arguments", "starts"),
    [
        (False, ["--target-jobs", "fom:"], 0),
        (True, ["--executor", "slurm-jobstep", "--target-jobs", "fom:"], 0),
        (True, ["--target-jobs", "fom:"], 1),
    ],
    ids=["here", "hands the batch on", "runs the batch"],
)
def test_a_batch_on_a_cluster_node_has_a_fork_server(monkeypatch, remote, arguments, starts):
    started = []
    monkeypatch.setattr(running, "start_server", lambda: started.append(1))
    monkeypatch.setattr(sys, "argv", ["snakemake", *arguments])
    running.start_batch(SimpleNamespace(remote_exec=remote))
    assert len(started) == starts
