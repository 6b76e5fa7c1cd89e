"""Reading and writing results: atomic, deterministic, with clear errors.

A result is written to a temporary file beside its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one. An HDF5 file ends
with the checksum of all bytes before it, so that a changed bit is noticed when the file is read. A
table is plain text without one: only what makes it unreadable or cuts its last line is noticed.

A damaged file is set aside when it is read: the next run finds it missing and makes it anew.
"""

from pdrom.core.store.atomic import atomic_path
from pdrom.core.store.finite import require_finite
from pdrom.core.store.hdf5 import open_hdf5, write_hdf5
from pdrom.core.store.tables import read_table, write_table

__all__ = [
    "atomic_path",
    "open_hdf5",
    "read_table",
    "require_finite",
    "write_hdf5",
    "write_table",
]
