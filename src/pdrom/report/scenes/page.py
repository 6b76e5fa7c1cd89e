"""The viewer's page of one scene."""

from pathlib import Path

from pdrom.report.viewer.page import write_page
from pdrom.report.viewer.runs import ViewedScene


def viewer(scene: ViewedScene, page: Path) -> None:
    """Write the ``page`` of ``scene``."""
    write_page([scene], page)
