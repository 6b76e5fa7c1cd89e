"""Files of models of small scenes for the page."""

import re
from pathlib import Path

import numpy as np

from pdrom.core.store import write_hdf5
from pdrom.model.mesh.types import save_mesh
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.subspace import model as subspaces
from pdrom.reduction.subspace.training import make_columns
from study.artifact.paths import File
from study.experiments.subspaces import LiveModels, Options, live
from study.live.page import live_page


def write_page(folder: Path, models: list[Path]) -> Path:
    """Write the page of some files of models, which lie below its folder."""
    out = folder / "live.html"
    scenes = [re.search(r'"scene":"(\w+)"', path.read_text("utf-8")) for path in models]
    files = [
        File(str(path), {"scene": scene[1] if scene else path.stem})
        for path, scene in zip(models, scenes, strict=True)
    ]
    live_page(files, outputs={"out": str(out)}, parts=[])
    return out


def write_models(
    scene: Scene, folder: Path, every: int = 2, k: int = 3
) -> tuple[Path, subspaces.SubspaceModel]:
    """Write the file of one model of ``k`` modes with sampled elements; return file and model."""
    reference = trajectory(scene, track_objective=False)
    (group,) = scene.groups
    elements = np.arange(0, group.elements, every)
    samples = {group.name: subspaces.Samples(elements, np.full(len(elements), float(every)))}
    model = subspaces.SubspaceModel(make_columns([scene], reference[1:], k), samples)
    save_mesh(scene.mesh, folder / "mesh.h5")
    with write_hdf5(folder / "train.h5") as file:
        file["positions"] = reference
    with write_hdf5(folder / "models.h5") as file:
        subspaces.store_columns(file.create_group("columns/own"), model.columns)
        labels = {"method": "ecsw-1e-02", "position_basis": "pod", "k": k, "base": "own"}
        subspaces.store_model(file.create_group("models/own"), labels, samples)
    asked = LiveModels(sizes=(k,))
    options = Options(scene=scene.config, title="A title", live=asked, joint_rows=())
    mesh, train, models, out = (
        File(str(folder / name), {}) for name in ("mesh.h5", "train.h5", "models.h5", "test.js")
    )
    files = {"subspaces": [models], "online": [], "bases": [], "samplings": []}
    live(mesh, train, options, out, **files)
    return folder / "test.js", model
