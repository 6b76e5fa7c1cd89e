"""A variant of a run: the same configuration with other kernels, instructions, threads or Python.

It runs in a copy of the project, because only one run at a time works in a folder.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

from pdrom.core.errors import PdromError
from pdrom.core.paths import TABLE
from pdrom.core.store import atomic_path, require_intact
from pdrom.pipeline.environment import KEEP
from pdrom.pipeline.folders import folders

PYTHON = "PYTHON"
# What a copy of the project does without: results, environments, caches.
LEFT_OUT = shutil.ignore_patterns(
    "results", ".venv*", ".snakemake", ".cache", ".git", "__pycache__", ".*_cache", "main.pdf"
)
# The end of a failed run's output that its message shows.
SHOWN = 500


class VariantError(PdromError):
    """A variant's run failed."""


def available(
    variants: Mapping[str, Mapping[str, str]], environment: Mapping[str, str]
) -> dict[str, dict[str, str]]:
    """Settings of each variant, without those that need a variable that the user has not set."""
    found = {}
    for name, settings in variants.items():
        templates = {key: Template(value) for key, value in settings.items()}
        needed = {wanted for t in templates.values() for wanted in t.get_identifiers()}
        if needed <= set(environment):
            found[name] = {key: t.substitute(environment) for key, t in templates.items()}
    return found


def run_variant(
    settings: Mapping[str, str],
    root: Path,
    folder: Path,
    configuration: Sequence[str],
    tables: Mapping[str, str],
) -> None:
    """Run a configuration with other settings, and keep its tables.

    Parameters
    ----------
    settings : environment variables of the variant
    root, folder : the project, and where its copy lies meanwhile
    configuration : configuration files
    tables : where each table is kept, by name

    Raises
    ------
    VariantError
        The run failed.
    """
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(root, folder, ignore=LEFT_OUT)
    options = ["--cores", "1", *(["--configfile", *configuration] if configuration else [])]
    results = folders(configuration, []).results
    targets = [TABLE.at(results, name=name) for name in tables]
    command = [*_program(settings), *options, "--", *targets]
    done = subprocess.run(
        command,
        cwd=folder,
        env=_environment(settings, folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        raise VariantError(f"variant in {folder}: {done.stdout[-SHOWN:].strip()}")
    for path, made in zip(tables.values(), targets, strict=True):
        require_intact(folder / made)
        with atomic_path(path) as temporary:
            shutil.copyfile(folder / made, temporary)
    shutil.rmtree(folder)


def _program(settings: Mapping[str, str]) -> list[str]:
    """Another Python needs an environment of its own, which the script makes."""
    if PYTHON in settings:
        return ["sh", "./reproduce"]
    return [sys.executable, "-m", "pdrom.pipeline.front"]


def _environment(settings: Mapping[str, str], folder: Path) -> dict[str, str]:
    own = {KEEP: " ".join(settings)}
    if PYTHON not in settings:
        own["PYTHONPATH"] = str((folder / "src").resolve())
        own["NUMBA_CACHE_DIR"] = str((folder / ".cache" / "numba").resolve())
    return {**os.environ, **settings, **own}
