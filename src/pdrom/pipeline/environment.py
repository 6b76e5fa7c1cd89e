"""Environment variables of the jobs: none that the user has set may change a result.

Who wants to see how far results depend on such settings names those that are to stay:
``PDROM_KEEP="OPENBLAS_CORETYPE" OPENBLAS_CORETYPE=Nehalem ./reproduce``.
"""

import os
from collections.abc import Mapping

from pdrom.pipeline.core_type import core_type_here

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
