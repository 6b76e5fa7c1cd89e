"""The tables of the study, one module a table; see `pdrom.tables.kit.declaration`."""

from pdrom.tables.kit.declaration import declared

__all__ = ["declared"]
