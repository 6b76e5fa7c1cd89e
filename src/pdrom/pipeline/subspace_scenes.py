"""Scenes with an effect that no position subspace takes: what they go without, and what asks."""

import logging

from pdrom.core.errors import ConfigurationError
from pdrom.pipeline.scenes import not_taken
from pdrom.pipeline.study import Study

log = logging.getLogger(__name__)


def check_subspaces(study: Study) -> None:
    """Say which scenes of ``study`` go without subspaces, auxiliary model and estimates.

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
                    "subspace (and no auxiliary model) takes"
                )
    for name, effects in outside.items():
        log.warning(
            "%s: no position subspaces, no auxiliary model and no estimated errors, since none "
            "takes the effect '%s'", name, "', '".join(effects),
        )  # fmt: skip


def _asking(study: Study) -> dict[str, tuple[str, ...]]:
    """Keys that ask for a subspace of the scenes that they name."""
    settings, guard = study.settings, study.settings.guard
    estimated = guard.action != "none" and guard.alarm == "estimate"
    return {
        "subspace.scenes": settings.subspace.scenes,
        "scaling.scenes": tuple(settings.scaling.scenes),
        "online.scenes": settings.online.scenes,
        "alternatives.scenes": tuple(settings.alternatives.scenes),
        "config/subspace_ablation.yaml: scenes": study.ablation.scenes,
        "guard.cases": tuple(case.scene for case in guard.cases),
        "guard.alarm = 'estimate'": tuple(study.scenes) if estimated else (),
    }
