"""Where a result comes from: configuration, code, libraries."""

import hashlib
import json
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from pdrom import __version__

LIBRARIES = ("numpy", "scipy", "numba", "h5py", "pandas", "matplotlib", "snakemake")


def configuration_hash(configuration: Any) -> str:
    """SHA-256 of the canonical JSON of a configuration."""
    canonical = json.dumps(configuration, sort_keys=True, default=str)
    return hashlib.sha256(canonical.encode()).hexdigest()


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


def attributes(configuration: Any) -> dict[str, str]:
    """Attributes for a result file; nothing in them differs between two equal runs."""
    return {
        "configuration": json.dumps(configuration, sort_keys=True, default=str),
        "configuration_sha256": configuration_hash(configuration),
        "pdrom_version": __version__,
        "python_version": platform.python_version(),
        "library_versions": json.dumps(library_versions(), sort_keys=True),
        "units": "SI (m, s, kg)",
    }
