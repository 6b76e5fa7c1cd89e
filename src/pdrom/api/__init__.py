"""pdrom from Python: build a scene, run it, make a basis, run it reduced, draw the results.

docs/library.md has a worked example.
"""

from pdrom.api.files import build_scene, load, load_scene, save
from pdrom.api.pictures import plot, view
from pdrom.api.records import FullRun, ReducedRun
from pdrom.api.runs import basis, methods, reduce, run

__all__ = [
    "FullRun", "ReducedRun", "basis", "build_scene", "load", "load_scene", "methods",
    "plot", "reduce", "run", "save", "view",
]  # fmt: skip


def __dir__() -> list[str]:
    return sorted(__all__)
