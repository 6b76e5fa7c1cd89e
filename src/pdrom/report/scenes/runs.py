"""Table of a scene's reduced runs: errors, failures, what was sampled."""

from collections.abc import Mapping

from pdrom.core.store import write_table
from pdrom.report.scenes.results import SceneResults


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the table; without a row where the scene names no group to reduce."""
    write_table(results.runs(), outputs["table"])
