"""The tables of the study, one module a table; see `study.tables.kit.declaration`."""

from study.tables.kit.declaration import declared

__all__ = ["declared"]
