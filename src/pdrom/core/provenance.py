"""Provenance of a result: what made it, with which settings, code and libraries.

A job states once what it is (`made_by`). Whatever `pdrom.core.store` writes meanwhile carries that:
every file in its checksum, HDF5 files inside as well. Nothing in it differs
between two equal runs: no date, no folder, and no commit, since a commit that changes a word of the
documentation makes no other result.
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
# Keys of a record, in the order in which they are written.
RECORD = (
    "made_by",
    "configuration_sha256",
    "code_sha256",
    "pdrom_version",
    "python_version",
    "library_versions",
)


# What the job at work says of itself, and its configuration as canonical JSON.
_JOB: ContextVar[Mapping[str, str]] = ContextVar("job", default=MappingProxyType({}))


@contextmanager
def made_by(name: str, configuration: Any, code: str = "") -> Iterator[None]:
    """Record the job ``name`` in all files that are written meanwhile.

    Parameters
    ----------
    name : a rule of the workflow, or a function of the package
    configuration : all settings of the job, hashed as JSON
    code : fingerprint of the code that it runs; empty outside of the workflow
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
    """Versions of the numerical libraries; "absent" for one that is not installed."""
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "absent"
    return found


def attributes() -> dict[str, str]:
    """`provenance` for a file that can also hold the whole configuration (HDF5)."""
    return {
        **_JOB.get(),
        "pdrom_version": __version__,
        "python_version": platform.python_version(),
        "library_versions": ", ".join(f"{k} {v}" for k, v in sorted(library_versions().items())),
        "units": "SI (m, s, kg)",
    }


def provenance() -> dict[str, str]:
    """Record of a file that is written now; the part about the job only where there is one."""
    everything = attributes()
    return {name: everything[name] for name in RECORD if name in everything}
