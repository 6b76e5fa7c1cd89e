"""A folder in which the real ``./reproduce`` runs a very small study with faults."""

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import yaml
from checkout import ROOT, copy_repository

from machines.same_results import run_digest, table_digest
from pdrom.core.store import check_file
from study.artifact.paths import MACHINE, MANIFEST
from study.tables import declared

MICRO = {
    "scenes": ["spring_oop"],
    "methods": ["block-deim"],
    "ranks": [2, "full"],
    "coarsen": {"resolution": 0.25, "frames": 0.05},
    "sensitivity": {"perturbations": [1e-10], "seeds": [1]},
    "timing": {"frames": 1, "warmup": 0, "repeats": 1, "numpy_frames": 1},
    "frame_times": {"processes": 1, "frames": 1, "warmup": 0, "repeats": 1},
    "subspace": {"scenes": ["spring_oop"], "sizes": [4], "tolerances": [1e-2]},
}
MICRO_FILE = "micro.yaml"
TIMED_FOLDERS = (
    "timings", "frame_times", "seconds", "breakeven", "effects", "left_out", "logs",
)  # fmt: skip
TIMED_FIGURES = ("local_share", "accuracy_cost", "alternatives")
SHIM = '#!/bin/sh\nPYTHONPATH="{hooks}" exec "{python}" {module} "$@"\n'


@dataclass(frozen=True)
class Sandbox:
    """A copy of the repository with the environment of the tests as its ``.venv``."""

    folder: Path

    @classmethod
    def make(cls, folder: Path) -> "Sandbox":
        copy_repository(folder)
        shutil.copy2(ROOT / "reproduce", folder)
        for lock in ROOT.glob("requirements*.lock"):
            shutil.copy2(lock, folder)
        (folder / MICRO_FILE).write_text(yaml.safe_dump(MICRO), encoding="utf-8")
        return cls(folder)._with_environment()

    def copy(self, folder: Path) -> "Sandbox":
        """Copy the state, with the times of files, to another folder."""
        shutil.copytree(self.folder, folder, symlinks=True)
        return Sandbox(folder)._with_environment()

    def _with_environment(self) -> "Sandbox":
        programs = self.folder / ".venv" / "bin"
        programs.mkdir(parents=True, exist_ok=True)
        hooks = Path(__file__).parent / "hooks"
        for name, module in (("python", ""), ("snakemake", "-m snakemake")):
            shim = SHIM.format(hooks=hooks, python=sys.executable, module=module)
            (programs / name).write_text(shim, encoding="utf-8")
            (programs / name).chmod(0o755)
        lock = (self.folder / "requirements.lock").read_bytes()
        # the shell passes a pattern that fits no file to the program
        stamp = f"{_cksum(lock)} {self.folder.resolve()}\n"
        packages = b".venv/lib/python*/site-packages/*.dist-info\n"
        stamp += f"{_cksum(packages)}\n"
        (self.folder / ".venv" / "complete").write_text(stamp, encoding="utf-8")
        # compiled kernels are shared with the repository, whose package the sandbox runs
        compiled = ROOT / ".cache" / "numba"
        compiled.mkdir(parents=True, exist_ok=True)
        (self.folder / ".cache").mkdir(exist_ok=True)
        if not (self.folder / ".cache" / "numba").exists():
            (self.folder / ".cache" / "numba").symlink_to(compiled)
        return self

    def use_its_own_package(self) -> None:
        """Run the package in this folder, which can be edited, and compile its kernels here."""
        (self.folder / ".cache" / "numba").unlink()
        for name in ("python", "snakemake"):
            shim = self.folder / ".venv" / "bin" / name
            text = shim.read_text(encoding="utf-8")
            shim.write_text(text.replace('/hooks"', f'/hooks:{self.folder}/src"'), encoding="utf-8")

    def start(self, *targets, program="./reproduce", fault="", **options):
        """Start ``./reproduce`` on the micro study, in a new session."""
        return subprocess.Popen(
            [program, "--configfile", MICRO_FILE, "--cores", "2", *targets],
            cwd=self.folder, env={**os.environ, "PDROM_FAULT": fault}, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            **options,
        )  # fmt: skip

    def run(self, *targets: str, **how) -> tuple[int, str]:
        """Exit status and output of a run; ``fault`` as in ``hooks/sitecustomize.py``."""
        process = self.start("--", *targets, **how)
        output, _ = process.communicate(timeout=600)
        return process.returncode, output

    def snakemake(self, *arguments: str) -> tuple[int, str]:
        """Exit status and output of ``snakemake`` without ``./reproduce``."""
        process = self.start(*arguments, program=".venv/bin/snakemake")
        output, _ = process.communicate(timeout=600)
        return process.returncode, output

    def finish(self, *targets: str) -> None:
        status, output = self.run(*targets)
        assert status == 0, output

    def path(self, name: str) -> Path:
        return self.folder / name

    def results(self) -> dict[str, str]:
        """Digest of every result without measured times; all results must be intact."""
        found = self.path("results").rglob("[!.]*")
        files = [p for p in found if p.is_file() and p.suffix != ".damaged"]
        with_checksum = [p for p in files if p.suffix != ".log"]
        assert {check_file(p) for p in with_checksum} == {"intact"}
        names = {str(p.relative_to(self.folder)): p for p in files}
        kept = {name: path for name, path in sorted(names.items()) if not _timed(path)}
        return {name: _digest(path, self.folder) for name, path in kept.items()}

    def temporaries(self) -> list[Path]:
        """Temporary files of the results, which do not have their final names yet."""
        files = [p for p in self.path("results").rglob(".*") if p.is_file()]
        return [p for p in files if re.search(r"\.[0-9a-f]{16}(\.|$)", p.name)]


def _cksum(content: bytes) -> str:
    done = subprocess.run(["cksum"], input=content, capture_output=True, check=True)
    return done.stdout.decode().strip()


def _timed(path: Path) -> bool:
    """Whether a file depends on times, as the manifest does by its checksums."""
    apart = "logs" in path.parts or path.name in (MANIFEST.pattern, MACHINE.pattern)
    return path.parts[-2] in TIMED_FOLDERS or path.stem in TIMED_FIGURES or apart


def _digest(path: Path, root: Path) -> str:
    if path.suffix == ".h5":
        return run_digest(path, attributes=True)
    if path.parent.name == "tables" and path.suffix == ".csv":
        return table_digest(declared()[path.stem], path, root)
    return hashlib.sha256(path.read_bytes()).hexdigest()


def wait_for(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait until ``condition`` holds while ``process`` runs."""
    limit = time.monotonic() + 120
    while not condition():
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < limit
        time.sleep(0.01)


def kill_all(process: subprocess.Popen[str]) -> str:
    """``kill -9`` a run with all its jobs at once, and return its output."""
    os.killpg(process.pid, signal.SIGKILL)
    return process.communicate(timeout=60)[0]
