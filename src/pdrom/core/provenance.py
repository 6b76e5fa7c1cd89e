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
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
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


@dataclass(frozen=True)
class Job:
    """A piece of work: a rule of the workflow, or a function of the package.

    configuration : canonical JSON of all its settings
    code : fingerprint of the code that it runs; empty outside of the workflow
    """

    name: str
    configuration: str
    code: str


_AT_WORK: ContextVar[Job | None] = ContextVar("job", default=None)


@contextmanager
def made_by(name: str, configuration: Any, code: str = "") -> Iterator[None]:
    """Record the job ``name`` in all files that are written meanwhile.

    Parameters
    ----------
    configuration : settings of the job, hashed as JSON
    code : fingerprint of the code that it runs
    """
    canonical = json.dumps(configuration, sort_keys=True, default=str)
    previous = _AT_WORK.set(Job(name, canonical, code))
    try:
        yield
    finally:
        _AT_WORK.reset(previous)


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


def provenance() -> dict[str, str]:
    """Record of a file that is written now; the part about the job only where there is one."""
    job = _AT_WORK.get()
    made = {}
    if job is not None:
        hashed = hashlib.sha256(job.configuration.encode()).hexdigest()
        made = {"made_by": job.name, "configuration_sha256": hashed}
        made |= {"code_sha256": job.code} if job.code else {}
    return {
        **made,
        "pdrom_version": __version__,
        "python_version": platform.python_version(),
        "library_versions": ", ".join(f"{k} {v}" for k, v in sorted(library_versions().items())),
    }


def attributes() -> dict[str, str]:
    """`provenance` for a file that can also hold the whole configuration (HDF5)."""
    job = _AT_WORK.get()
    settings = {"configuration": job.configuration} if job is not None else {}
    return {**settings, **provenance(), "units": "SI (m, s, kg)"}


def as_text(record: Mapping[str, str]) -> str:
    """A record in one line, as a checksum holds it."""
    return json.dumps(dict(record), sort_keys=True)
