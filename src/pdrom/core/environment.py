"""Environment variables of the jobs: none that the user has set may change a result.

Who wants to see how far results depend on such settings names those that are to stay:
``PDROM_KEEP="OPENBLAS_CORETYPE" OPENBLAS_CORETYPE=Nehalem ./reproduce``.

OpenBLAS holds kernels for many processors and takes the newest that fit; they round differently, so
that it is told which to take. It does not check the variable ``OPENBLAS_CORETYPE``: kernels that
the processor lacks instructions for would end the process. The project's own kernels are compiled
on the machine, by default for its very processor; the compiler is told a family of processors
likewise (docs/decisions/0015-one-target.md). All has to be set before NumPy is loaded.
"""

import os
import platform
from collections.abc import Mapping
from pathlib import Path

# Variables that set up numerical libraries, Python, Matplotlib and TeX.
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
# every instruction set that the compiler draws on for it: Linux's name of each, and the compiler's
COMPILED_HASWELL = {
    "abm": "lzcnt", "avx2": "avx2", "bmi1": "bmi", "bmi2": "bmi2", "f16c": "f16c", "fma": "fma",
    "movbe": "movbe", "popcnt": "popcnt",
}  # fmt: skip
TARGET, FEATURES = "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"


def settled(
    environment: Mapping[str, str], kernels: str | None, target: Mapping[str, str]
) -> dict[str, str]:
    """An environment without inherited settings, and with those of this project.

    What the variable ``PDROM_KEEP`` names is neither cleared nor set.

    Parameters
    ----------
    kernels : OpenBLAS's name of the kernels to use, None leaves the choice to it
    target : variables that choose what to compile for, see `compiled_for`
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
    if TARGET not in asked:  # the features are those of the target
        fixed |= target
    return kept | {name: value for name, value in fixed.items() if name not in asked}


def settle() -> None:
    """Give this process, and so its jobs, the `settled` environment; before NumPy is loaded."""
    system, machine, features = platform.system(), platform.machine(), features_here()
    environment = settled(
        os.environ, core_type(system, machine, features), compiled_for(machine, features)
    )
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


def compiled_for(machine: str, features: set[str]) -> dict[str, str]:
    """Variables that make the compiler's target one that every processor of a family has.

    Haswell where an x86-64 processor has what the compiler draws on for it, on ARM what the
    architecture itself has. Empty elsewhere: the compiler then takes the machine's own.

    Parameters
    ----------
    machine, features : as in `core_type`
    """
    if machine in ("aarch64", "arm64"):
        return {TARGET: "generic", FEATURES: ""}
    if machine != "x86_64" or not features >= COMPILED_HASWELL.keys():
        return {}
    return {TARGET: "haswell", FEATURES: ",".join(f"+{name}" for name in COMPILED_HASWELL.values())}


def processor_features(cpuinfo: str) -> set[str]:
    """Flags that every processor of /proc/cpuinfo has; none where it names none."""
    flags = [
        set(line.partition(":")[2].split())
        for line in cpuinfo.splitlines()
        if line.partition(":")[0].strip() in ("flags", "Features")
    ]
    return set.intersection(*flags) if flags else set()


def features_here() -> set[str]:
    """`processor_features` of this machine; none where the system does not say."""
    try:
        return processor_features(CPUINFO.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return set()
