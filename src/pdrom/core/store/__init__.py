"""Reading and writing results: atomic, deterministic, sealed, with clear errors.

A result is written to a temporary file beside its target and renamed when complete, so that an
interrupted job never leaves a half-written file and never damages an older one. An HDF5 file has
its checksum inside (`block`), every other result in a hidden file beside it (`seal`); whoever reads
the result compares (`condition`). A job of the workflow sets a damaged one aside: the next run
finds it missing and makes it again. Nobody else moves a file that it reads.
"""

from pdrom.core.store.atomic import atomic_path, require_place
from pdrom.core.store.condition import (
    Condition,
    check_file,
    provenance_of,
    read_seal,
    require_intact,
)
from pdrom.core.store.finite import require_finite
from pdrom.core.store.hdf5 import open_hdf5, write_hdf5
from pdrom.core.store.seal import Seal, seal_path
from pdrom.core.store.tables import read_table, write_table
from pdrom.core.store.text import read_text, write_text

__all__ = [
    "Condition",
    "Seal",
    "atomic_path",
    "check_file",
    "open_hdf5",
    "provenance_of",
    "read_seal",
    "read_table",
    "read_text",
    "require_finite",
    "require_intact",
    "require_place",
    "seal_path",
    "write_hdf5",
    "write_table",
    "write_text",
]
