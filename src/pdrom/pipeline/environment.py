"""Environment variables of the jobs: none that the user has set may change a result.

Who wants to see how far results depend on such settings names those that are to stay:
``PDROM_KEEP="OPENBLAS_CORETYPE" OPENBLAS_CORETYPE=Nehalem ./reproduce``.

OpenBLAS holds kernels for many processors and takes the newest that fit; they round differently, so
that it is told which to take. It does not check the variable ``OPENBLAS_CORETYPE``: kernels that
the processor lacks instructions for would end the process. All has to be set before NumPy is
loaded.
"""

import os
import platform
from collections.abc import Mapping
from pathlib import Path

# Settings of numerical libraries, of Python, Matplotlib and TeX.
CLEARED = (
    "OPENBLAS_", "GOTO_", "BLIS_", "MKL_", "VECLIB_", "OMP_", "GOMP_", "KMP_",
    "NPY_", "NUMPY_", "SCIPY_", "NUMBA_", "NUMEXPR_", "PYTHON", "MPL", "MATPLOTLIB",
    "TEX", "BIB", "BST",
)  # fmt: skip
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
KEPT = ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "PYTHON", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
# Names of further variables to keep, and to leave as they are.
KEEP = "PDROM_KEEP"
# Date in the manuscript and the figures, so that equal ones are equal bytes: 1 January 2026.
DATE = "1767225600"
CPUINFO = Path("/proc/cpuinfo")
# every instruction that the kernels named Haswell use beyond those that NumPy itself demands
HASWELL = {"avx2", "fma"}


def settled(environment: Mapping[str, str], kernels: str | None) -> dict[str, str]:
    """An environment without inherited settings, and with those of this project.

    What the variable ``PDROM_KEEP`` names is neither cleared nor set.

    Parameters
    ----------
    kernels : OpenBLAS's name of the kernels to use, None leaves the choice to it
    """
    asked = environment.get(KEEP, "").split()
    kept = {
        name: value
        for name, value in environment.items()
        if name in (*KEPT, *asked) or not name.startswith(CLEARED)
    }
    fixed = {
        **dict.fromkeys(THREADS, "1"),
        "PYTHONHASHSEED": "0",
        "MPLBACKEND": "Agg",
        "LC_ALL": "C.UTF-8",
        "SOURCE_DATE_EPOCH": DATE,
        "FORCE_SOURCE_DATE": "1",
    }
    if kernels:
        fixed["OPENBLAS_CORETYPE"] = kernels
    return kept | {name: value for name, value in fixed.items() if name not in asked}


def settle() -> None:
    """Give this process, and so its jobs, the `settled` environment; before NumPy is loaded."""
    environment = settled(os.environ, core_type_here())
    for name in set(os.environ) - set(environment):
        del os.environ[name]
    os.environ.update(environment)


def core_type(system: str, machine: str, features: set[str]) -> str | None:
    """Kernels that every processor of a family has; None where there is nothing to choose.

    Haswell (2013; also AMD's Zen) where the processor has its instructions, otherwise Nehalem,
    whose instructions NumPy demands anyway; on ARM those of the architecture itself. None on other
    systems: their library is not OpenBLAS, or they do not say what the processor has.

    Parameters
    ----------
    system, machine : as `platform.system` and `platform.machine` name them
    features : flags of the processor, as Linux names them
    """
    if system != "Linux":
        return None
    if machine == "x86_64":
        return "Haswell" if features >= HASWELL else "Nehalem"
    return "ARMV8" if machine == "aarch64" else None


def processor_features(cpuinfo: str) -> set[str]:
    """Flags that every processor of /proc/cpuinfo has; none where it names none."""
    flags = [
        set(line.partition(":")[2].split())
        for line in cpuinfo.splitlines()
        if line.partition(":")[0].strip() in ("flags", "Features")
    ]
    return set.intersection(*flags) if flags else set()


def core_type_here() -> str | None:
    """`core_type` of this machine."""
    try:
        cpuinfo = CPUINFO.read_text(encoding="utf-8", errors="replace")
    except OSError:
        cpuinfo = ""
    return core_type(platform.system(), platform.machine(), processor_features(cpuinfo))
