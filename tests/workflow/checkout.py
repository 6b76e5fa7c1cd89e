"""Copies of the repository on which Snakemake plans."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import meshio

from pdrom.model.mesh.generators import cloth
from places import ROOT

# Snakemake without the 0.1 s for which it sleeps before each file that it touches.
TOUCH = (
    "-c",
    "import snakemake.cli as cli, snakemake.executors.touch as touch\n"
    "touch.Executor.SLEEPING_TIME = 0.0\n"
    "cli.main()",
    "--touch",
)
DOCUMENTS = ("paper/main.tex", "paper/supplement.tex", "paper/preamble.tex")
PAPER = (
    *DOCUMENTS, "paper/own", "paper/sections", "paper/supplement", "paper/references.bib",
    "paper/numbers.yaml",
)  # fmt: skip
PARTS = ("Snakefile", "config", *PAPER, "src", "workflow")


@dataclass(frozen=True)
class Made:
    """A file of a plan: the rule and log of its job, the inputs of a finished job, its state."""

    file: str
    rule: str
    log: str
    inputs: tuple[str, ...]
    plan: str


@dataclass(frozen=True)
class Checkout:
    """A clean copy of the parts of the repository that the workflow reads."""

    folder: Path

    def snakemake(self, *arguments: str, **how) -> subprocess.CompletedProcess[str]:
        """Run snakemake in the copy, on the copy's package and one core."""
        return self.looks("--cores", "1", *arguments, **how)

    def looks(
        self, *arguments, python=sys.executable, program=("-m", "snakemake"), cwd=None, **variables
    ):
        """Run snakemake without a number of cores, which commands that run no job do not need."""
        own = {"PYTHONPATH": f"{self.folder}/src", "XDG_CACHE_HOME": f"{self.folder}/.cache"}
        return subprocess.run(
            [python, *program, *arguments],
            cwd=cwd or self.folder, env={**os.environ, **own, **variables},
            stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600, check=False,
        )  # fmt: skip

    def summary(self, *arguments: str) -> list[Made]:
        """Rows of Snakemake's summary of the plan."""
        done = self.looks("--detailed-summary", *arguments)
        assert done.returncode == 0, done.stderr
        rows = [line.split("\t") for line in done.stdout.splitlines() if "\t" in line]
        return [Made(r[0], r[2], r[3], tuple(r[4].split(",")), r[-1]) for r in rows[1:]]

    def planned(self, *arguments: str) -> set[str]:
        return {made.file for made in self.summary(*arguments) if made.plan == "update pending"}

    def count_as_finished(self, *arguments: str) -> None:
        """Put empty files in the place of results.

        ``--touch`` makes Snakemake record code, parameters and inputs of every job. A plan depends
        on nothing else.
        """
        for name in self.planned(*arguments):
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        done = self.snakemake("--forceall", *arguments, program=TOUCH)
        assert done.returncode == 0, done.stderr

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace ``old``, which must be there, in one file."""
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        assert old in text, f"{path} has no {old!r}"
        file.write_text(text.replace(old, new, 1), encoding="utf-8")

    def register(self, registry: str, entry: str, module: str, code: str) -> None:
        """Add a module and list ``entry`` (a name and a class of it) first in a registry."""
        name, attribute = entry.split(":")
        path = self.folder / "src" / Path(*module.split(".")).with_suffix(".py")
        path.write_text(code, encoding="utf-8")
        self.edit(registry, "    {\n", f'    {{\n        "{name}": "{module}:{attribute}",\n')

    def files(self, *parts: str) -> list[Path]:
        """Files, and those below folders."""
        paths = [self.folder / part for part in parts]
        found = [p for path in paths for p in (path, *path.rglob("*"))]
        return [path for path in found if path.is_file()]


def only_line(output: str) -> str:
    """The last line, the only one about the error; no job was counted."""
    assert "Traceback" not in output
    assert "Job stats" not in output
    (line,) = [line for line in output.splitlines() if line.startswith("pdrom: ")]
    assert output.strip().splitlines()[-1] == line
    return line


def write_sheet(path: Path, wave: float = 0.0) -> None:
    """A mesh file of a horizontal sheet with waves of this height, m."""
    mesh = cloth(6, 6, "xz", wave=wave)
    meshio.write(path, meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]))


def copy_repository(folder: Path) -> Checkout:
    """Copy all that the workflow reads; the package with its compiled modules and their dates."""
    for part in PARTS:
        (folder / part).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copy2 if part == "src" else shutil.copyfile
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, folder / part, copy_function=copy)
        else:
            copy(ROOT / part, folder / part)
    return Checkout(folder)
