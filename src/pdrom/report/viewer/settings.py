"""Section ``viewer``: what the viewer of a study shows."""

from pdrom.core.names import SceneName
from pdrom.core.yamlfile import ConfigModel
from pdrom.reduction.local.ranks import Rank


class Viewer(ConfigModel):
    """Scenes (the study's first ones if empty) and basis sizes of results/viewer/index.html."""

    scenes: tuple[SceneName, ...] = ()
    ranks: tuple[Rank, ...] = (6, 20)
