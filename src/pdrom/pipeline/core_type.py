"""Which kernels OpenBLAS takes, so that the last digits do not depend on the processor.

OpenBLAS holds kernels for many processors and takes the newest that fit; they round differently.
The variable ``OPENBLAS_CORETYPE`` has to be set before NumPy is loaded. OpenBLAS does not check it:
kernels that the processor lacks instructions for would end the process.
"""

import platform
from pathlib import Path

CPUINFO = Path("/proc/cpuinfo")
# every instruction that the kernels named Haswell use beyond those that NumPy itself demands
HASWELL = {"avx2", "fma"}


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
