"""Copies of the repository on which Snakemake plans."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from places import ROOT

PAPER = ("paper/main.tex", "paper/sections", "paper/references.bib")
PARTS = ("Snakefile", "config", *PAPER, "src", "workflow")


@dataclass(frozen=True)
class Checkout:
    """A clean copy of the parts of the repository that the workflow reads."""

    folder: Path

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run snakemake in the copy, on the copy's package and one core."""
        return self.looks("--cores", "1", *arguments)

    def looks(
        self, *arguments: str, python: str | Path = sys.executable
    ) -> subprocess.CompletedProcess[str]:
        """The same without a number of cores, which what only looks does not ask for."""
        return subprocess.run(
            [python, "-m", "snakemake", *arguments],
            cwd=self.folder,
            env={
                **os.environ,
                "PYTHONPATH": str(self.folder / "src"),
                "PYTHONDONTWRITEBYTECODE": "1",
                "XDG_CACHE_HOME": str(self.folder / ".cache"),
            },
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )

    def planned(self, *arguments: str) -> set[str]:
        """Files that a run would make, by Snakemake's own summary of the plan."""
        done = self.looks("--summary", *arguments)
        assert done.returncode == 0, done.stderr
        rows = [line.split("\t") for line in done.stdout.splitlines() if "\t" in line]
        return {row[0] for row in rows[1:] if row[-1] == "update pending"}

    def count_as_finished(self, *arguments: str) -> None:
        """Put empty files in the place of results.

        ``--touch`` makes Snakemake record code, parameters and inputs of every job, which is all
        that it looks at when it plans.
        """
        for name in self.planned(*arguments):
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        done = self.snakemake("--touch", "--forceall", *arguments)
        assert done.returncode == 0, done.stderr

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace ``old``, which must be there, in one file."""
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        assert old in text, f"{path} has no {old!r}"
        file.write_text(text.replace(old, new, 1), encoding="utf-8")


def copy_repository(folder: Path) -> Checkout:
    """Copy the files that git knows (all but caches, where there is no git)."""
    for path in _files():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, target)
    return Checkout(folder)


def _files() -> list[str]:
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *PARTS]
    try:
        done = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True)
        files = [name for name in done.stdout.split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        found = [p for part in PARTS for p in ((ROOT / part), *(ROOT / part).rglob("*"))]
        files = [str(p.relative_to(ROOT)) for p in found if "__pycache__" not in p.parts]
    return [name for name in files if (ROOT / name).is_file()]
