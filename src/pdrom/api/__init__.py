"""pdrom from Python: a scene, its run, a basis of projections, the run with them reduced, pictures.

docs/python.md has a worked example.
"""

from pdrom.api.files import load, save
from pdrom.api.pictures import plot, view
from pdrom.api.runs import FullRun, ReducedRun, basis, methods, reduce, run
from pdrom.api.scenes import build_scene, load_scene
from pdrom.reduction.local.guard_settings import GuardSettings

__all__ = [
    "FullRun",
    "GuardSettings",
    "ReducedRun",
    "basis",
    "build_scene",
    "load",
    "load_scene",
    "methods",
    "plot",
    "reduce",
    "run",
    "save",
    "view",
]
