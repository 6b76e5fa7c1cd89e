"""Where the project lies, for tests that read its configuration or its code."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONFIG = ROOT / "config"
