"""Entries of a scene's list of effects, as typed configurations."""

from typing import Any

from pydantic import ValidationError

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import describe, shown
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import EffectConfig


def effect_config(entry: Any, index: int) -> EffectConfig:
    """Typed configuration of one entry of ``effects``; ValueError names what is wrong."""
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
