"""The tables of the study, one module a table; see `pdrom.tables.declaration`."""

from pdrom.tables.find import declared, timing_columns

__all__ = ["declared", "timing_columns"]
