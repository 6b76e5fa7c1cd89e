"""Times of frames in a process of its own: ``python -m study.experiments.kit.fresh_process FILE``.

Where a process has its arrays and its code in memory changes its times by more than its repeats
scatter. Only new processes show that; a fork would inherit the places.
"""

import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.errors import PdromError
from pdrom.core.store import read_table, write_table
from pdrom.core.store.checksum import damaged_set_aside
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.mesh.types import load_mesh
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.subspace.model import load_models
from study.experiments.kit.costs import variant
from study.experiments.kit.load_reduction import load_reduction
from study.experiments.kit.measurement import Protocol, Variant, measure
from study.experiments.kit.settings import Solver

FULL, CONTROL, REDUCED = "full", "control", "reduced"
COLUMNS = [
    "process", "scene", "vertices", "frames", "role", "group", "method", "position_basis", "k", "r",
    "ms_per_frame",
]  # fmt: skip


class Projections(ConfigModel):
    """A group whose projections are reduced, and the files of its basis and sampling."""

    group: str
    method: str
    r: int
    spec: MethodSpec
    basis: str
    sampling: str


class Subspaces(ConfigModel):
    """Models of a file that are timed; every one if ``chosen`` is None."""

    path: str
    chosen: tuple[tuple[str, str, int], ...] | None = None

    def wants(self, method: object, position_basis: object, k: object) -> bool:
        """Whether the model of a ``method`` in ``position_basis`` of ``k`` modes is timed."""
        return self.chosen is None or (method, position_basis, k) in self.chosen


class TimedScene(ConfigModel):
    """A scene, timed in full order, once more as a control, and with its reductions.

    mesh : file of the mesh; it is made if there is none
    """

    scene: SceneConfig
    mesh: str | None = None
    projections: tuple[Projections, ...] = ()
    subspaces: Subspaces | None = None


class Request(ConfigModel):
    """Request to a process: loops to time, in the random order that ``seed`` gives."""

    scenes: tuple[TimedScene, ...]
    timing: Protocol
    solver: Solver
    seed: int
    result: str


def in_fresh_process(request: Request, folder: Path) -> pd.DataFrame:
    """Rows of `COLUMNS` that a new process measures; ``folder`` receives the ``request``."""
    file = folder / "request.json"
    file.write_text(request.model_dump_json(), encoding="utf-8")
    new_process("study.experiments.kit.fresh_process", str(file))
    return read_table(request.result)


def new_process(module: str, *arguments: str) -> None:
    """Run a ``module`` in a process of its own.

    Raises
    ------
    PdromError
        The process failed; the message ends with its last line.
    """
    ended = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode:
        last = ended.stderr.strip().rpartition("\n")[2]
        raise PdromError(f"a process that times frames ended with {ended.returncode}: {last}")


def timed(request: Request) -> pd.DataFrame:
    """Time the loops of a ``request`` in this process."""
    variants = [variant for scene in request.scenes for variant in _variants(scene, request)]
    order = np.random.default_rng(request.seed).permutation(len(variants))
    timing = request.timing
    measured = measure([variants[i] for i in order], timing.warmup, timing.repeats)
    rows = [{**m.labels, "process": request.seed, "ms_per_frame": m.frame} for m in measured]
    table = pd.DataFrame([rows[i] for i in np.argsort(order)], columns=COLUMNS)
    return table.astype({"k": "Int64", "r": "Int64"})


def _variants(asked: TimedScene, request: Request) -> Iterator[Variant]:
    config = asked.scene
    mesh = config.mesh.build(Path()) if asked.mesh is None else load_mesh(asked.mesh)
    scene = Scene.build(config, mesh)
    system = scene.system_with(request.solver)
    frames = min(request.timing.frames, config.frames)
    common = {"scene": config.name, "vertices": mesh.vertices, "frames": config.frames}

    def made(labels: dict[str, Any], steps: Sequence[LocalStep]) -> Variant:
        return variant(scene, system, steps, frames, {**common, **labels})

    for role in (FULL, CONTROL):
        yield made({"role": role}, scene.groups)
    for own in asked.projections:
        reduction = load_reduction(load_basis(own.basis), own.sampling, own.spec, r=own.r)
        step = ReducedLocalStep(scene.group(own.group), reduction)
        labels: dict[str, Any] = {"role": REDUCED, "position_basis": "full"}
        labels |= own.model_dump(include={"group", "method", "r"})
        yield made(labels, replace_group(scene, own.group, step))
    if asked.subspaces is None:
        return
    for found, model in load_models(asked.subspaces.path):
        if asked.subspaces.wants(found["method"], found["position_basis"], found["k"]):
            labels = {"role": REDUCED, "group": "all", "r": model.elements_evaluated(scene)}
            yield Variant({**common, **labels, **found}, *model.loop(scene), frames)


def main(file: str) -> None:
    """Time what a file requests and write the rows where it says."""
    request = Request.model_validate_json(Path(file).read_text(encoding="utf-8"))
    with damaged_set_aside():  # the process is part of a job
        write_table(timed(request), request.result)


if __name__ == "__main__":
    main(sys.argv[1])
