"""Tables of the study, one module for each subject; see `study.tables.kit.declaration`."""

from study.tables.kit.declaration import declared

__all__ = ["declared"]
