"""Provenance of a result: the job that made it, its settings, code and libraries.

Inside the context `made_by`, `pdrom.core.store` stores the provenance with the checksum of every
file it writes, in HDF5 files also as attributes. Two runs of one job have equal provenance: it
contains no date and no commit, since a commit may change only documentation. In the workflow it
identifies a file: a copy under another name does not count as the result.
"""

import hashlib
import json
import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import Any

from pdrom import __version__

LIBRARIES = ("numpy", "scipy", "numba", "h5py", "pandas", "matplotlib", "snakemake")
# Keys of a provenance record, in the order in which they are written.
RECORD = (
    "made_by", "configuration_sha256", "code_sha256", "pdrom_version", "python_version",
    "library_versions",
)  # fmt: skip
# Keys that identify a result; the first and the last are stored only in its checksum.
ORIGIN = ("file", *RECORD[:3], "inputs_sha256")

# Name and configuration hash of the running job, and its configuration as canonical JSON.
_JOB: ContextVar[Mapping[str, str]] = ContextVar("job", default=MappingProxyType({}))


@contextmanager
def made_by(name: str, configuration: Any, code: str = "", inputs: str = "") -> Iterator[None]:
    """Record the job ``name`` (a rule or a function) in all files written in this context.

    ``configuration`` are all its settings, hashed as JSON. In the workflow, ``code`` is the
    fingerprint of the code that the job runs, ``inputs`` a hash of the files that it reads.
    """
    canonical = json.dumps(configuration, sort_keys=True, default=str)
    hashed = hashlib.sha256(canonical.encode()).hexdigest()
    job = {"configuration": canonical, "made_by": name, "configuration_sha256": hashed}
    hashes = {"code_sha256": code, "inputs_sha256": inputs}
    previous = _JOB.set(job | {key: value for key, value in hashes.items() if value})
    try:
        yield
    finally:
        _JOB.reset(previous)


@cache
def library_versions() -> dict[str, str]:
    """Return versions of the packages in `LIBRARIES`; "absent" for a package not installed."""
    found = dict.fromkeys(LIBRARIES, "absent")
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def attributes() -> dict[str, str]:
    """Return attributes for the job's HDF5 files: provenance, configuration, units (SI)."""
    return {
        **{key: value for key, value in _JOB.get().items() if key != "inputs_sha256"},
        "pdrom_version": __version__,
        "python_version": platform.python_version(),
        "library_versions": ", ".join(f"{k} {v}" for k, v in sorted(library_versions().items())),
        "units": "SI (m, s, kg)",
    }


def provenance(path: str | os.PathLike[str] = "") -> dict[str, str]:
    """Return the provenance of the file ``path`` that is being written, by the running job if any.

    The files of the workflow also record their path, and a hash of their job's inputs.
    """
    everything = {**_JOB.get(), **attributes()}
    if path and "code_sha256" in everything:
        everything["file"] = os.path.normpath(path)
    names = dict.fromkeys((*RECORD, *ORIGIN))
    return {name: everything[name] for name in names if name in everything}
