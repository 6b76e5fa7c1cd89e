"""The tables of the study, one module a subject; see `study.tables.kit.declaration`."""

from study.tables.kit.declaration import declared

__all__ = ["declared"]
