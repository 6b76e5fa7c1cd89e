"""Refuse or skip position subspaces of scenes whose effects they cannot represent."""

import logging

from pdrom.core.errors import ConfigurationError, SceneError
from pdrom.reduction.subspace.exported import DOUBLES, require_known
from study.artifact.paths import LIVE_MODEL
from study.experiments.live import LARGEST
from study.pipeline.contents import labels_of
from study.pipeline.scenes import not_taken
from study.pipeline.study import Study

log = logging.getLogger(__name__)


def check_subspaces(study: Study) -> None:
    """Say which scenes of ``study`` go without subspaces.

    Raises
    ------
    ConfigurationError
        One of them is named where a subspace is asked for.
    """
    outside = {
        name: effects
        for name, config in {**study.scenes, **study.online}.items()
        if (effects := not_taken(config))
    }
    for key, scenes in _asking(study).items():
        for name in scenes:
            if name in outside:
                raise ConfigurationError(
                    f"{key}: scene '{name}' has the effect '{outside[name][0]}', which no position "
                    "subspace takes"
                )
    for name, effects in outside.items():
        log.warning(
            "%s: no position subspaces, since none takes the effect '%s'",
            name,
            "', '".join(effects),
        )


def _asking(study: Study) -> dict[str, tuple[str, ...]]:
    """Scenes of which each key of the configuration requests a subspace."""
    settings = study.settings
    return {
        "subspace.scenes": settings.subspace.scenes,
        "scaling.scenes": tuple(settings.scaling.scenes),
        "online.scenes": settings.online.scenes,
        "alternatives.scenes": tuple(settings.alternatives.scenes),
    }


def check_live(study: Study) -> None:
    """ConfigurationError for a scene that the page with running models cannot hold."""
    for name in (labels["scene"] for labels in labels_of(study, LIVE_MODEL)):
        try:
            require_known(study.scene(name))
        except SceneError as error:
            raise ConfigurationError(f"live.scenes: {error}") from error
        size = _live_bytes(study, name)
        if size > LARGEST:
            raise ConfigurationError(
                f"live.scenes: scene '{name}' takes at least {size / 1e6:.1f} MB of models on "
                f"{study.vertices[name]} vertices, allowed are {LARGEST / 1e6:.1f}: choose fewer "
                f"modes (live.sizes = {list(study.settings.live.sizes)})"
            )


def _live_bytes(study: Study, name: str) -> float:
    """Size of the vertices, masses and bases of a scene in the file of its models."""
    settings, vertices = study.settings, study.vertices[name]
    section = settings.subspace if name in study.scenes else settings.online
    sizes = [k for k in settings.live.sizes if k in section.sizes and "pod" in section.bases]
    entries = [vertices * (k + 4) for k in sizes]  # four affine columns come with the modes
    bases = sum(count * (8 if count <= DOUBLES else 4) for count in entries)
    return (vertices * 32 + bases) * 4 / 3  # written in base 64
