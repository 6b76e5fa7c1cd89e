"""Where a result comes from: configuration, code, libraries, machine."""

import hashlib
import json
import os
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_info

from pdrom import __version__

LIBRARIES = ("numpy", "scipy", "numba", "cholespy", "h5py", "pandas", "matplotlib", "snakemake")


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


def machine() -> dict[str, Any]:
    """The machine that timings belong to, and the code that ran on it."""
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "pdrom": __version__,
        "commit": _commit(),
        "threads": max((pool["num_threads"] for pool in threadpool_info()), default=1),
        "libraries": library_versions(),
    }


def _cpu_model() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.lower().startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def _commit() -> str:
    """Commit of the checkout that the package lies in; "unknown" outside one."""
    command = ["git", "rev-parse", "--short=12", "HEAD"]
    try:
        done = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() if done.returncode == 0 else "unknown"
