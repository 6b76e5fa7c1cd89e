"""Build scenes in Python, simulate them, train and run reduced models, and draw the results.

docs/library.md has a worked example.
"""

from pdrom.api.cost import cost
from pdrom.api.files import build_scene, load, load_scene, save
from pdrom.api.model import Model, load_model
from pdrom.api.pictures import plot, view
from pdrom.api.records import Errors, Run
from pdrom.api.runs import basis, methods, run
from pdrom.api.training import train

__all__ = [
    "Errors", "Model", "Run", "basis", "build_scene", "cost", "load", "load_model", "load_scene",
    "methods", "plot", "run", "save", "train", "view",
]  # fmt: skip
