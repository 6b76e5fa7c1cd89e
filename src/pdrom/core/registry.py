"""Registries, which map names in configuration files to the code that implements them."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from pdrom.core.errors import ConfigurationError, choices


class Registry(dict[str, str]):
    """Map from a name to "module:attribute"; the module is imported only if the name is used."""

    def __init__(self, kind: str, entries: Mapping[str, str]) -> None:
        """Store ``entries`` (name -> "module:Class"); ``kind`` names an entry in error messages."""
        super().__init__(entries)
        self.kind = kind

    def __missing__(self, name: str) -> str:
        raise ConfigurationError(f"unknown {self.kind} '{name}'{choices(name, sorted(self))}")

    def load(self, name: str) -> Any:
        """Import the module of ``name`` and return the attribute that the entry names."""
        module, _, attribute = self[name].partition(":")
        return getattr(import_module(module), attribute)
