"""The tables of the study, one module a table; see `pdrom.tables.kit.declaration`."""

from pdrom.tables.kit.declaration import declared, timing_columns

__all__ = ["declared", "timing_columns"]
