"""Record of the machine that runs a study: processor, linear algebra kernels, libraries, code."""

import os
import platform
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy.linalg  # noqa: F401 loads a linear algebra library
import scipy.linalg  # noqa: F401 loads another one
from threadpoolctl import threadpool_info

from pdrom import __version__
from pdrom.core.provenance import library_versions
from pdrom.core.yamlfile import ConfigModel


class Machine(ConfigModel):
    """Machine and code that produced the results; timings and last digits depend on them.

    threads : largest number of threads that one of the libraries would use
    kernels : linear algebra and threading libraries in the process, see `loaded_kernels`
    target : processor that the project's code is compiled for; empty leaves it to the compiler
    """

    cpu: str
    cores: int | None
    system: str
    python: str
    pdrom: str
    commit: str
    threads: int
    libraries: dict[str, str]
    kernels: tuple[dict[str, Any], ...]
    target: str = ""


def machine() -> Machine:
    """Describe this machine and this process."""
    kernels = loaded_kernels()
    return Machine(
        cpu=_cpu_model(), cores=os.cpu_count(), python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}", pdrom=__version__, commit=_commit(),
        threads=max((each["threads"] for each in kernels), default=1), libraries=library_versions(),
        kernels=kernels, target=os.environ.get("NUMBA_CPU_NAME", ""),
    )  # fmt: skip


def loaded_kernels() -> tuple[dict[str, Any], ...]:
    """List linear algebra and threading libraries in this process, sorted by file name.

    ``kind`` is "blas" or "openmp"; ``architecture`` is the processor that the kernels are written
    for, None if the library does not tell.
    """
    found = [
        {
            "file": Path(pool["filepath"]).name, "kind": pool["user_api"],
            "library": pool["internal_api"], "version": pool["version"],
            "architecture": pool.get("architecture"), "threads": pool["num_threads"],
        }
        for pool in threadpool_info()
    ]  # fmt: skip
    return tuple(sorted(found, key=lambda each: each["file"]))


def _cpu_model() -> str:
    info = Path("/proc/cpuinfo")
    found = re.search(r"(?mi)^model name.*?: *(.*)", info.read_text() if info.is_file() else "")
    return found[1].strip() if found else platform.processor() or "unknown"


def _commit() -> str:
    command = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short=12", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()
