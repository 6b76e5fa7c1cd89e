"""The tables of the study: columns, and one function a table."""

from pdrom.tables.columns import COLUMNS, TIMING_COLUMNS

__all__ = ["COLUMNS", "TIMING_COLUMNS"]
