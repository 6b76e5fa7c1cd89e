"""Kill processes of the tiny study at random, go on by the same command, compare the tables.

Usage: ./reproduce run env PYTHONPATH=tests:tests/workflow python tests/machines/random_kills.py \\
           FOLDER [--kills 100] [--seed 1]

The tables of a part of the tiny study (no times among them) are made in a sandbox in FOLDER, at
first undisturbed. Then one process after the other is killed (SIGKILL): the fork server, a client
that waits for its job, a job, or the front, Snakemake's process, each kind as often as the others
while it is there. Whenever a run has ended, no process of it may be left after a minute, and the
same command goes on; whenever everything is made, a part of it is deleted. The status is 0 if the
tables and runs at the end are those of the undisturbed run, bit by bit, and nothing was left
behind.
"""

import argparse
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import psutil
from same_results import differences, run_digests, table_digests
from sandbox import Sandbox

RESULTS = "results/studies/tiny"
TABLES = ("singular_values", "reconstruction_error", "sensitivity", "reduced_reruns")
TARGETS = [f"{RESULTS}/tables/{name}.csv" for name in TABLES]
COMMAND = ["./reproduce", "--configfile", "config/tiny.yaml", "--cores", "2", "--keep-going", "--"]
KINDS = ("server", "client", "job", "front")
GONE = 60.0  # seconds until no process of a run that has ended is left


def processes(folder: Path) -> Iterator[psutil.Process]:
    """Processes that work in a folder."""
    for process in psutil.process_iter():
        try:
            if Path(process.cwd()) == folder and process.status() != psutil.STATUS_ZOMBIE:
                yield process
        except psutil.Error:
            continue


def kind(process: psutil.Process) -> str:
    """One of the kinds, or nothing for a shell between two of them."""
    try:
        words = " ".join(process.cmdline())
        if "fork_server/client.py" in words:
            return "client" if " -I -S " in words and "bash" not in words else ""
        if "fork_server.server" in words:
            return (
                "job" if "fork_server.server" in " ".join(process.parent().cmdline()) else "server"
            )
        if "fork_server/alone.py" in words:
            return "job"
        return "front" if "study.pipeline.front" in words else ""
    except (psutil.Error, AttributeError):  # it has ended meanwhile
        return ""


class Trial:
    """Runs of the study in a sandbox, and what was killed in them."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.sandbox = Sandbox.make(folder / "run")
        self.folder = self.sandbox.folder.resolve()
        self.random = random.Random(seed)
        self.killed: Counter[str] = Counter()
        self.statuses: Counter[str] = Counter()
        self.outlived = 0

    def start(self) -> subprocess.Popen[bytes]:
        """The command, whose output goes to a log."""
        with (self.folder / "run.log").open("ab") as log:
            return subprocess.Popen(
                [*COMMAND, *TARGETS], cwd=self.folder, stdin=subprocess.DEVNULL,
                stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip

    def finish(self) -> None:
        """A run that must succeed."""
        if self.start().wait():
            sys.exit(f"random_kills: the run failed, see {self.folder}/run.log")

    def disturb(self, kills: int) -> None:
        """A run with at most so many kills."""
        run = self.start()
        until = sum(self.killed.values()) + kills
        while run.poll() is None and sum(self.killed.values()) < until:
            time.sleep(self.random.expovariate(1 / 2.0))
            if run.poll() is None:
                self._kill()
        status = run.wait()
        self.statuses[str(status)] += 1
        self._wait_for_others()
        sys.stdout.write(f"{time.strftime('%H:%M:%S')} status {status}, {dict(self.killed)}\n")
        sys.stdout.flush()
        if status == 0:
            parts = sorted(p for p in (self.folder / RESULTS).iterdir() if p.is_dir())
            for part in self.random.sample(parts, len(parts) // 2):
                shutil.rmtree(part)

    def _kill(self) -> None:
        """Kill one process of a kind that was killed least, of those that are there."""
        found = [(name, p) for p in processes(self.folder) if (name := kind(p))]
        if not any(name in ("client", "job") for name, _ in found):
            return  # it still plans
        least = min(self.killed[name] for name, _ in found)
        name, victim = self.random.choice([f for f in found if self.killed[f[0]] == least])
        try:
            victim.kill()
        except psutil.NoSuchProcess:
            return
        self.killed[name] += 1

    def _wait_for_others(self) -> None:
        """See whether something outlives the run."""
        until = time.monotonic() + GONE
        while left := list(processes(self.folder)):
            if time.monotonic() > until:
                self.outlived += len(left)
                sys.stdout.write(f"left behind: {[p.cmdline() for p in left]}\n")
                for process in left:
                    process.kill()
                return
            time.sleep(0.1)


def main() -> None:
    """Make, disturb, compare."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    trial = Trial(asked.folder, asked.seed)
    results = trial.folder / RESULTS
    trial.finish()
    expected = table_digests(results) | run_digests(results)
    shutil.rmtree(results)
    while (left := asked.kills - sum(trial.killed.values())) > 0:
        trial.disturb(left)
    trial.finish()
    found = table_digests(results) | run_digests(results)
    different = list(differences(expected, found))
    equal = len(expected) - len(different)
    sys.stdout.write(
        f"killed {dict(trial.killed)}; runs by status {dict(trial.statuses)}; "
        f"{trial.outlived} processes left behind; {equal} of {len(expected)} files equal\n"
    )
    sys.stdout.writelines(f"  {line}\n" for line in different)
    sys.exit(1 if different or trial.outlived else 0)


if __name__ == "__main__":
    main()
