"""Load libraries before the fork server forks jobs; the import of this module loads them.

They are the libraries that most jobs or all figures use, the modules that every job imports, and
the modules of the experiment with the most jobs.
"""

import gc
import os
from importlib import import_module

from study.artifact.planned import import_planned

LIBRARIES = (
    "h5py", "matplotlib.backends.backend_agg", "matplotlib.backends.backend_pdf", "numpy",
    "pandas", "study.artifact.logs", "pdrom.core.provenance", "study.experiments.kit.base",
    "study.experiments.reruns", "pydantic", "scipy.linalg", "scipy.sparse.linalg",
    "snakemake.cli", "snakemake.iocontainers", "snakemake.script", "threadpoolctl", "yaml",
)  # fmt: skip

os.setpgid(0, 0)  # the run handles keys such as Ctrl-C; this process must not receive them
import_planned()
for library in LIBRARIES:
    import_module(library)
# register the functions of numba here, or else every fork would do so
target = import_module("numba.core.registry").cpu_target
target.typing_context.refresh()
target.target_context.refresh()
gc.collect()
gc.freeze()
