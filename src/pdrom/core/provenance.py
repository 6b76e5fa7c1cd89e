"""Provenance of a result: the job that made it, its settings, code and libraries.

Inside the context `made_by`, `pdrom.core.store` stores the provenance beside the checksum of every
file it writes, in HDF5 files also as attributes. Two runs of one job have equal provenance: it
contains no date, no folder and no commit, since a commit may change only documentation.
"""

import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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

# Name and configuration hash of the running job, and its configuration as canonical JSON.
_JOB: ContextVar[Mapping[str, str]] = ContextVar("job", default=MappingProxyType({}))


@contextmanager
def made_by(name: str, configuration: Any, code: str = "") -> Iterator[None]:
    """Context in which the job ``name`` is recorded in all files that are written.

    Parameters
    ----------
    name : name of a rule of the workflow, or of a function of the package
    configuration : all settings of the job, hashed as JSON
    code : fingerprint of the code that the job runs; empty outside of the workflow
    """
    canonical = json.dumps(configuration, sort_keys=True, default=str)
    hashed = hashlib.sha256(canonical.encode()).hexdigest()
    job = {"configuration": canonical, "made_by": name, "configuration_sha256": hashed}
    previous = _JOB.set(job | {"code_sha256": code} if code else job)
    try:
        yield
    finally:
        _JOB.reset(previous)


@cache
def library_versions() -> dict[str, str]:
    """Versions of the packages in `LIBRARIES`; "absent" for one that is not installed."""
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "absent"
    return found


def attributes() -> dict[str, str]:
    """Attributes of an HDF5 file that the job writes: provenance, configuration, units (SI)."""
    return {
        **_JOB.get(),
        "pdrom_version": __version__,
        "python_version": platform.python_version(),
        "library_versions": ", ".join(f"{k} {v}" for k, v in sorted(library_versions().items())),
        "units": "SI (m, s, kg)",
    }


def provenance() -> dict[str, str]:
    """Provenance of a file that is written now; without a running job it names no job."""
    everything = attributes()
    return {name: everything[name] for name in RECORD if name in everything}
