"""After a fault, a plain rerun gives the results of an undisturbed run.

The real ``./reproduce`` runs a very small study in a separate folder, while processes are killed,
disks fill up and files are damaged. Measured times are not compared (`Sandbox.results`).
The long tests are marked slow: ``./reproduce test -m slow``.
"""

import os
import re
import shutil
import signal
import subprocess
from pathlib import Path

import psutil
import pytest
from checkout import only_line, write_sheet
from sandbox import Sandbox, kill_all, wait_for

from pdrom.core.store import checksum_path
from places import MICRO_RESULTS
from study.pipeline.signals import ENDINGS, KEPT

TABLE = f"{MICRO_RESULTS}/tables/reconstruction_error.csv"
SNAPSHOTS = f"{MICRO_RESULTS}/snapshots/spring_oop/spring.h5"
BASIS = f"{MICRO_RESULTS}/pod/spring_oop/spring/none-affine-vectorised.h5"
SAMPLING = f"{MICRO_RESULTS}/sampling/spring_oop/spring/block-deim"
RUN = f"{MICRO_RESULTS}/fom/spring_oop/train.h5"
slow = pytest.mark.slow


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Sandbox:
    """From the mesh to one table, without a fault."""
    sandbox = Sandbox.make(tmp_path_factory.mktemp("undisturbed") / "run")
    sandbox.finish(TABLE)
    return sandbox


@pytest.fixture
def sandbox(undisturbed: Sandbox, tmp_path: Path) -> Sandbox:
    """A copy of the finished run, to be disturbed."""
    return undisturbed.copy(tmp_path / "run")


@pytest.fixture
def fresh(tmp_path: Path) -> Sandbox:
    return Sandbox.make(tmp_path / "run")


def last_lines(output: str, count: int = 2) -> str:
    return "\n".join(output.splitlines()[-count:])


def heals(sandbox: Sandbox, undisturbed: Sandbox, target: str = TABLE) -> None:
    """Check that a rerun gives the results of an undisturbed run and leaves no temporary file."""
    sandbox.finish(target)
    assert sandbox.results() == undisturbed.results()
    assert not sandbox.temporaries()


def test_lost_rows_and_a_killed_job_are_named_and_made_again(undisturbed, sandbox):
    """The first run finds a file that was damaged after the plan; the next loses its last job."""
    sandbox.path(BASIS).unlink()
    waiting = "/\\.none-affine-vectorised\\.[0-9a-f]{16}"
    process = sandbox.start("--", TABLE, fault=f"hold:{waiting}")
    wait_for(lambda: bool(sandbox.temporaries()), process)
    cut(sandbox.path(SNAPSHOTS))
    sandbox.path("release").touch()
    output = process.communicate(timeout=600)[0]
    assert process.returncode != 0
    assert f"{SNAPSHOTS}: damaged, its c" in last_lines(output)
    assert f"renamed to {Path(SNAPSHOTS).name}.damaged, the next run" in last_lines(output)
    status, output = sandbox.run(TABLE, fault="kill:reconstruction_error")
    assert status != 0
    for part in ("job reconstruction_error_table failed", TABLE, "SIGKILL"):
        assert part in last_lines(output)
    assert not sandbox.path(TABLE).exists()
    heals(sandbox, undisturbed)


@slow
def test_a_run_that_was_killed_with_all_its_jobs_is_completed_by_the_next_run(undisturbed, fresh):
    """Half-written files and the locks of both programs remain, and no user unlocks by hand."""
    for folder in ("fom", "snapshots", "pod", "reruns"):
        kill_all(_caught_writing(fresh, folder))
        assert list(fresh.path(".snakemake/locks").iterdir())
    heals(fresh, undisturbed)


def _caught_writing(
    sandbox: Sandbox, folder: str, kind: str = "slow", *targets: str
) -> subprocess.Popen[str]:
    """A run with a job that writes a file of ``folder`` and is stopped there as ``kind`` says."""
    process = sandbox.start(*targets or ("--", TABLE), fault=f"{kind}:/{MICRO_RESULTS}/{folder}/")
    place = sandbox.path(MICRO_RESULTS) / folder
    wait_for(lambda: any(place in p.parents for p in sandbox.temporaries()), process)
    return process


@slow
@pytest.mark.parametrize(
    ("send", "number", "kind"),
    [
        (os.killpg, signal.SIGINT, "slow"),
        (os.killpg, signal.SIGHUP, "hold"),
        (os.kill, signal.SIGTERM, "hold"),  # one of its jobs would never end without a signal
    ],
    ids=["interrupted", "SIGHUP to all", "SIGTERM to the run alone"],
)
def test_a_stopped_run_stops_its_jobs_and_can_be_continued(undisturbed, fresh, send, number, kind):
    process = _caught_writing(fresh, "fom", kind)
    send(process.pid, number)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert only_line(output) == f"pdrom: {ENDINGS[number]}; {KEPT}"
    heals(fresh, undisturbed)


@slow
def test_a_run_whose_fork_server_is_killed_says_so_and_can_be_continued(undisturbed, fresh):
    process = _caught_writing(fresh, "fom", "hold")
    children = psutil.Process(process.pid).children()
    (server,) = (child for child in children if "forkserver" in " ".join(child.cmdline()))
    server.kill()
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert re.search("pdrom: job fom failed while making .* exit status 255", output)
    heals(fresh, undisturbed)


@slow
def test_a_run_on_a_full_disk_fails_and_is_completed_by_the_next_run(undisturbed, sandbox):
    sandbox.path(TABLE).unlink()
    status, output = sandbox.run(TABLE, fault="full:reconstruction_error")
    assert status != 0
    assert f"failed: {TABLE}: cannot be written (No space left" in last_lines(output)
    assert not sandbox.temporaries()
    heals(sandbox, undisturbed)


def cut(path: Path) -> None:
    """Cut off the end and keep the times, as a bad disk does."""
    before, content = path.stat(), path.read_bytes()
    path.write_bytes(content[: len(content) * 6 // 10])
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def lose_the_checksum(path: Path) -> None:
    """Remove the checksum, as by copying only the file, or killing a job between both files."""
    checksum_path(path).unlink()


def copy_of_training(path: Path) -> None:
    """The file of another trajectory with its dates and its checksum."""
    shutil.copy2(path.with_name("train.h5"), path)


def test_damaged_results_are_named_by_the_plan_and_made_again(undisturbed, sandbox):
    """Several results at once, although all files that are made from them exist and are newer."""
    other = f"{MICRO_RESULTS}/fom/spring_oop/heldout.h5"
    damages = {other: copy_of_training, SNAPSHOTS: Path.unlink, BASIS: cut}
    damages |= {f"{SAMPLING}.csv": lose_the_checksum, f"{SAMPLING}.h5": Path.unlink}
    for name, damage in damages.items():
        damage(sandbox.path(name))
    planned = sandbox.start("-n", "--", TABLE).communicate(timeout=600)[0]
    assert set(re.findall(r"^pdrom: (\S+): .*; it is made again$", planned, re.M)) == {*damages}
    assert re.search(r"^fom +1$", planned, re.M)
    heals(sandbox, undisturbed)
    planned = sandbox.start("-n", "--", TABLE).communicate(timeout=600)[0]
    assert "Nothing to be done" in planned


def run_while_all_code_is_edited(sandbox: Sandbox, *targets: str) -> None:
    """Make every module fail after the first job has started; undo this after the run."""
    process = _caught_writing(sandbox, "meshes", "hold", "--cores", "1", "--", *targets)
    sources = {path: path.read_text() for path in sandbox.path("src").rglob("*.py")}
    for path, text in sources.items():
        path.write_text(f"{text}\n\nraise RuntimeError('edited')\n")
    sandbox.path("release").touch()
    said, _ = process.communicate(timeout=600)
    assert process.returncode == 0, said
    for path, text in sources.items():
        path.write_text(text)
    assert "Nothing to be done" in sandbox.snakemake("-n", *targets)[1]


def test_a_job_ignores_edits_of_the_code_during_the_run(fresh):
    fresh.use_its_own_package()
    _, planned = fresh.snakemake("-n", "--verbose")
    meshes = set(re.findall(rf"{MICRO_RESULTS}/meshes/\w+.h5", planned))
    assert len(meshes) > 1
    run_while_all_code_is_edited(fresh, *meshes)


MESH = "config/scenes/sheet.obj"


@pytest.mark.parametrize("name", [MESH, "workflow/scripts/artifact.py"])
def test_a_file_that_is_edited_while_a_job_reads_it_is_refused(name, fresh):
    """Even if the edit is undone before the job ends; the next run makes the result again."""
    _read_mesh(fresh)
    process = _caught_writing(fresh, "meshes", "hold", "--", RUN)
    text = fresh.path(name).read_text()
    fresh.path(name).write_text(f"{text}\n# edited\n")
    fresh.path(name).write_text(text)
    fresh.path("release").touch()
    said, _ = process.communicate(timeout=600)
    assert process.returncode != 0
    assert f"{name}: edited during the run; run the same command" in last_lines(said)
    assert not list(fresh.path(f"{MICRO_RESULTS}/meshes").glob("[!.]*.h5"))
    fresh.finish(RUN)


def _read_mesh(sandbox: Sandbox, wave: float = 0.0) -> None:
    """Let the scene read its mesh, with waves of this height (m), from the file `MESH`."""
    scene = sandbox.path("config/scenes/spring_oop.yaml")
    text = re.sub("mesh: .*", "mesh: {kind: file, path: sheet.obj}", scene.read_text())
    scene.write_text(text)
    write_sheet(sandbox.path(MESH), wave)


@slow
def test_a_changed_mesh_file_reruns_the_jobs_that_depend_on_it(tmp_path):
    """Even if the new file is older than the results, as after unpacking an archive."""
    first, second = (Sandbox.make(tmp_path / name) for name in ("first", "second"))
    for sandbox, wave in ((first, 0.0), (second, 0.1)):
        _read_mesh(sandbox, wave)
        sandbox.finish(TABLE)
    flat = first.results()
    write_sheet(first.path(MESH), 0.1)
    os.utime(first.path(MESH), (0.0, 0.0))
    first.finish(TABLE)
    assert first.results() == second.results() != flat
