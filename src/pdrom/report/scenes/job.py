"""Rule of an artifact of one scene: the scene's results -> its files."""

from collections.abc import Mapping
from importlib import import_module

from pydantic import BaseModel, ConfigDict

from pdrom.model.effects.entries import EffectConfigs
from pdrom.report.figures.kit.holdings import Holdings
from pdrom.report.figures.kit.options import Rank
from pdrom.report.scenes.catalogue import module
from pdrom.report.scenes.results import SceneResults


class SceneOrder(BaseModel):
    """Order of an artifact of one scene, with the contents of the configuration.

    folder : where the results lie
    ranks : basis sizes, where not every one is shown
    title : of the scene
    subspaces : whether it holds position subspaces
    effects : of the scene
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    scene: str
    folder: str
    holdings: Holdings
    ranks: tuple[Rank, ...]
    settings: dict[str, float]
    title: str
    subspaces: bool = False
    effects: EffectConfigs = ()

    @property
    def results(self) -> SceneResults:
        """Results that the artifact reads."""
        return SceneResults(
            self.scene,
            self.folder,
            self.holdings,
            self.settings,
            self.ranks,
            self.title,
            self.subspaces,
            self.effects,
        )


def make(order: SceneOrder, outputs: Mapping[str, str]) -> None:
    """Make an artifact; ``outputs`` are its files by the names of `SceneArtifact.outputs`."""
    import_module(module(order.name)).make(order.results, outputs)
