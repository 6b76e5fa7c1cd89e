"""Tables of a scene: its reduced runs, effects and costs."""

from pathlib import Path

from pdrom.core.store import write_table
from pdrom.report.viewer.runs import ViewedScene


def runs(scene: ViewedScene, table: Path) -> None:
    """Write errors, failures and samples of ``scene`` to ``table``; no row if none is reduced."""
    write_table(scene.tables["runs"](), table, with_checksum=False)


def advice(scene: ViewedScene, effects: Path, costs: Path) -> None:
    """Write what each effect of ``scene`` does, ``effects``, and errors and times, ``costs``."""
    write_table(scene.tables["effects_contribution"](), effects)
    write_table(scene.tables["accuracy_cost"](), costs)
