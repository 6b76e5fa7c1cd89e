"""Entries of a scene's list of effects: as typed configurations, and bound to a mesh."""

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, SerializeAsAny, ValidationError

from pdrom.core.errors import ConfigurationError, SceneError
from pdrom.core.yamlfile import describe, shown
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import Effect, EffectConfig
from pdrom.model.mesh.types import Mesh


def effect_config(entry: Any, index: int) -> EffectConfig:
    """Typed configuration of ``entry``, number ``index`` of ``effects``; ValueError for a fault."""
    if isinstance(entry, EffectConfig):
        return entry
    if not isinstance(entry, dict) or not isinstance(entry.get("effect"), str):
        raise ValueError(f"effects[{index}] = {shown(entry, 60)}: a mapping with a key 'effect'")
    try:
        model = EFFECTS.load(entry["effect"]).Config
    except ConfigurationError as error:
        raise ValueError(f"effects[{index}]: {error}") from error
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        fault = describe(error, model)
        raise ValueError(f"effects[{index}] ({entry['effect']}): {fault}") from error


def _typed(entries: Any) -> tuple[EffectConfig, ...]:
    if not isinstance(entries, (list, tuple)):
        raise ValueError("a list of effects is required")
    return tuple(effect_config(entry, index) for index, entry in enumerate(entries))


EffectConfigs = Annotated[tuple[SerializeAsAny[EffectConfig], ...], BeforeValidator(_typed)]


def bind(config: EffectConfig, scene: str, mesh: Mesh, masses: np.ndarray) -> Effect:
    """Effect ``config`` on a mesh of ``masses`` (N,) kg; SceneError names ``scene`` and effect."""
    try:
        return EFFECTS.load(config.effect)(config, mesh, masses)
    except SceneError as error:
        raise SceneError(f"scene '{scene}', effect '{config.effect}': {error}") from error
