"""Folders of the project, for tests that read its configuration or its code."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CONFIG = ROOT / "config"
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))

# Folders of the results and the manuscript of the small study of the workflow's tests.
MICRO_RESULTS = "results/studies/micro"
MICRO_MANUSCRIPT = f"{MICRO_RESULTS}/paper/main.pdf"


def tracked(*options: str) -> list[Path]:
    """Files that git lists (without options: the index); the test is skipped without git."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *options], cwd=ROOT, capture_output=True, check=False
    )
    if listed.returncode:
        pytest.skip("no clone of the repository")
    paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    return [path for path in paths if path.is_file()]
