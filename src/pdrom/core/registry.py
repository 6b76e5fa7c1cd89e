"""Registries, which map names in configuration files to the code that implements them.

A registry maps each name to a text ``"package.module:attribute"``. The module is imported only when
the name is used.
"""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

from pdrom.core.errors import ConfigurationError, choices


class Registry(Mapping[str, str]):
    """Read-only map from a name to its implementation, given as "module:attribute"."""

    def __init__(self, kind: str, entries: Mapping[str, str]) -> None:
        """Store ``entries`` (name -> "module:Class"); ``kind`` names an entry in error messages."""
        self.kind = kind
        self._entries = dict(entries)

    def __getitem__(self, name: str) -> str:
        try:
            return self._entries[name]
        except KeyError:
            allowed = choices(name, sorted(self._entries))
            raise ConfigurationError(f"unknown {self.kind} '{name}'{allowed}") from None

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def module(self, name: str) -> str:
        """Name of the module that implements ``name``; ConfigurationError for an unknown name."""
        return self[name].partition(":")[0]

    def load(self, name: str) -> Any:
        """Import the module of ``name`` and return the attribute that the entry names."""
        module, _, attribute = self[name].partition(":")
        return getattr(import_module(module), attribute)
