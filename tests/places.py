"""Where the project lies, for tests that read its configuration or its code."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONFIG = ROOT / "config"

# Where the results of the small study of the workflow's tests lie, and its manuscript.
MICRO_RESULTS = "results/studies/micro"
MICRO_MANUSCRIPT = f"{MICRO_RESULTS}/paper/main.pdf"
