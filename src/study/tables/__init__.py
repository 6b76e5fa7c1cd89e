"""Tables of the study, one module for each subject; shared code is in `study.tables.kit`."""

from study.tables.kit.declaration import declared

__all__ = ["declared"]
