"""Rule of an artifact of one scene: the scene's results -> its files."""

from collections.abc import Mapping
from importlib import import_module

from pydantic import BaseModel, ConfigDict

from pdrom.report.figures.kit.holdings import Holdings
from pdrom.report.scenes.catalogue import module
from pdrom.report.scenes.results import SceneResults


class SceneOrder(BaseModel):
    """What a job is told to make, for which scene, and what the configuration holds of it.

    folder : where the results lie
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    scene: str
    folder: str
    holdings: Holdings
    settings: dict[str, float]


def make(order: SceneOrder, outputs: Mapping[str, str]) -> None:
    """Make an artifact; ``outputs`` are its files by the names of `SceneArtifact.outputs`."""
    results = SceneResults(order.scene, order.folder, order.holdings, order.settings)
    import_module(module(order.name)).make(results, outputs)
