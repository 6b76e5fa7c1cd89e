"""Environment variables of the jobs, set so that inherited ones cannot change a result.

A user who wants to study the influence of a variable names it in ``PDROM_KEEP`` to retain it:
``PDROM_KEEP="OPENBLAS_CORETYPE" OPENBLAS_CORETYPE=Nehalem ./reproduce``.

OpenBLAS has kernels for many processors, which round differently, and selects the newest that the
processor supports. ``OPENBLAS_CORETYPE`` fixes the selection; OpenBLAS does not check whether the
processor has the required instructions, without which the process crashes. Numba compiles this
project's kernels on the machine that runs them; ``NUMBA_CPU_NAME`` makes it compile for a family of
processors (docs/decisions/0015-one-target.md). All variables must be set before NumPy is loaded.
"""

import os
import platform
import re
from collections.abc import Mapping
from pathlib import Path

# Name prefixes of environment variables to remove: numerical libraries, Python, Matplotlib, TeX.
CLEARED = (
    "OPENBLAS_", "GOTO_", "BLIS_", "MKL_", "VECLIB_", "OMP_", "GOMP_", "KMP_",
    "NPY_", "NUMPY_", "SCIPY_", "NUMBA_", "NUMEXPR_", "PYTHON", "MPL", "MATPLOTLIB",
    "TEX", "BIB", "BST",
)  # fmt: skip
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
KEPT = ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "PYTHON", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
# Variable that lists the names of variables to leave as the user has set them.
KEEP = "PDROM_KEEP"
# Fixed date in the manuscript and figures, for reproducible files: 1 January 2026.
DATE = "1767225600"
CPUINFO = Path("/proc/cpuinfo")
# instruction sets that OpenBLAS's Haswell kernels need in addition to those that NumPy needs
HASWELL = {"avx2", "fma"}
# instruction sets of code that Numba compiles for Haswell: Linux's name -> the compiler's (LLVM's)
COMPILED_HASWELL = {
    "abm": "lzcnt", "avx2": "avx2", "bmi1": "bmi", "bmi2": "bmi2", "f16c": "f16c", "fma": "fma",
    "movbe": "movbe", "popcnt": "popcnt",
}  # fmt: skip
TARGET, FEATURES = "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"


def settled(
    environment: Mapping[str, str], kernels: str | None, target: Mapping[str, str]
) -> dict[str, str]:
    """Return a copy of ``environment`` with this project's settings in place of inherited ones.

    Variables with a prefix of `CLEARED` are removed, except for `KEPT`, then the project's are set:
    also those of `core_type` (``kernels``) and `compiled_for` (``target``). A variable named in
    ``PDROM_KEEP`` is neither removed nor set.
    """
    asked = environment.get(KEEP, "").split()
    kept = {
        name: value
        for name, value in environment.items()
        if name in (*KEPT, *asked) or not name.startswith(CLEARED)
    }
    fixed = {
        **dict.fromkeys(THREADS, "1"), "PYTHONHASHSEED": "0", "MPLBACKEND": "Agg",
        "LC_ALL": "C.UTF-8", "SOURCE_DATE_EPOCH": DATE, "FORCE_SOURCE_DATE": "1",
    }  # fmt: skip
    if kernels:
        fixed["OPENBLAS_CORETYPE"] = kernels
    if TARGET not in asked:  # FEATURES in ``target`` would not fit the user's TARGET
        fixed |= target
    return kept | {name: value for name, value in fixed.items() if name not in asked}


def settle() -> None:
    """Replace `os.environ`, which child processes inherit, by `settled`, before NumPy loads."""
    system, machine, features = platform.system(), platform.machine(), features_here()
    kernels = core_type(system, machine, features)
    environment = settled(os.environ, kernels, compiled_for(machine, features))
    for name in set(os.environ) - set(environment):
        del os.environ[name]
    os.environ.update(environment)


def core_type(system: str, machine: str, features: set[str]) -> str | None:
    """Return OpenBLAS's name of kernels for a whole processor family; None to set no kernels.

    On Linux, x86-64: Haswell (2013; also AMD's Zen) if the processor has its instructions, or else
    Nehalem, whose instructions NumPy requires anyway; ARM: the base architecture. None on other
    systems: their library is not OpenBLAS, or they do not list the processor's instructions.
    """
    if system != "Linux":
        return None
    if machine == "x86_64":
        return "Haswell" if features >= HASWELL else "Nehalem"
    return "ARMV8" if machine == "aarch64" else None


def compiled_for(machine: str, features: set[str]) -> dict[str, str]:
    """Return environment variables that make Numba compile for a whole family of processors.

    Haswell if an x86-64 processor has the instruction sets `COMPILED_HASWELL`; on ARM the base
    architecture. Otherwise empty: Numba then compiles for the processor on which it runs.
    """
    if machine in ("aarch64", "arm64"):
        return {TARGET: "generic", FEATURES: ""}
    if machine != "x86_64" or not features >= COMPILED_HASWELL.keys():
        return {}
    return {TARGET: "haswell", FEATURES: ",".join(f"+{name}" for name in COMPILED_HASWELL.values())}


def processor_features(cpuinfo: str) -> set[str]:
    """Return flags that all processors in ``cpuinfo`` (text of /proc/cpuinfo) share."""
    flags = re.findall(r"^\s*(?:flags|Features)\s*:(.*)", cpuinfo, re.MULTILINE)
    return set.intersection(*(set(line.split()) for line in flags)) if flags else set()


def features_here() -> set[str]:
    """Return flags that all processors of this machine share; empty if they cannot be read."""
    try:
        return processor_features(CPUINFO.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return set()
