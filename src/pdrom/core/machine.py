"""Record of the machine that runs a study: processor, linear algebra kernels, libraries, code."""

import os
import platform
import subprocess
from importlib import import_module
from pathlib import Path

from threadpoolctl import threadpool_info

from pdrom import __version__
from pdrom.core.provenance import library_versions
from pdrom.core.yamlfile import ConfigModel

# modules whose import loads the linear algebra libraries; NumPy and SciPy each bring their own
LINEAR_ALGEBRA = ("numpy.linalg", "scipy.linalg")


class Kernels(ConfigModel):
    """A linear algebra or threading library that is loaded in this process.

    file : name of the shared library
    kind : "blas" or "openmp"
    architecture : processor that its kernels are written for; None if the library does not tell
    """

    file: str
    kind: str
    library: str
    version: str | None
    architecture: str | None
    threads: int


class Machine(ConfigModel):
    """Machine and code that produced the results; timings and last digits depend on both.

    threads : largest number of threads that one of the libraries would use
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
    kernels: tuple[Kernels, ...]
    target: str = ""


def machine() -> Machine:
    """Record of this machine and this process."""
    kernels = loaded_kernels()
    return Machine(
        cpu=_cpu_model(), cores=os.cpu_count(), python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}", pdrom=__version__, commit=_commit(),
        threads=max((each.threads for each in kernels), default=1), libraries=library_versions(),
        kernels=kernels, target=os.environ.get("NUMBA_CPU_NAME", ""),
    )  # fmt: skip


def loaded_kernels() -> tuple[Kernels, ...]:
    """Linear algebra and threading libraries in this process, sorted by file."""
    for module in LINEAR_ALGEBRA:
        import_module(module)
    found = [
        Kernels(
            file=Path(pool["filepath"]).name, kind=pool["user_api"], library=pool["internal_api"],
            version=pool["version"], architecture=pool.get("architecture"),
            threads=pool["num_threads"],
        )
        for pool in threadpool_info()
    ]  # fmt: skip
    return tuple(sorted(found, key=lambda each: each.file))


def _cpu_model() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.lower().startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"


def _commit() -> str:
    """Git commit of the checkout that contains the package; "unknown" without a checkout."""
    command = ["git", "rev-parse", "--short=12", "HEAD"]
    try:
        done = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() if done.returncode == 0 else "unknown"
