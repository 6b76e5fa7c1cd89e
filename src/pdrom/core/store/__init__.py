"""Reading and writing results: atomic, deterministic, with checksums and clear errors.

A result is written to a temporary file beside its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one. An HDF5 file has
its checksum inside, every other result in a hidden file beside it; every reader compares them. A
job of the workflow sets a damaged one aside: the next run finds it missing and makes it again.
Nobody else moves a file that it reads.
"""

from pdrom.core.store.atomic import (
    atomic_path,
    read_table,
    read_text,
    require_finite,
    require_own,
    require_place,
    write_table,
    write_text,
)
from pdrom.core.store.checksum import (
    Checksum,
    Condition,
    check_file,
    checksum_path,
    provenance_of,
    read_checksum,
    require_intact,
)
from pdrom.core.store.hdf5 import open_hdf5, require_self_contained, write_hdf5

__all__ = [
    "Checksum",
    "Condition",
    "atomic_path",
    "check_file",
    "checksum_path",
    "open_hdf5",
    "provenance_of",
    "read_checksum",
    "read_table",
    "read_text",
    "require_finite",
    "require_intact",
    "require_own",
    "require_place",
    "require_self_contained",
    "write_hdf5",
    "write_table",
    "write_text",
]
