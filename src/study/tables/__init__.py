"""Tables of the study, one module for each subject; `study.tables.kit` has what they share."""

from study.tables.kit.declaration import declared

__all__ = ["declared"]
