"""Reduced models of a scene in a file that a page loads, to run them in the reader's browser."""

import json
import logging
from collections.abc import Iterator
from math import ceil
from typing import Any

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.packed import pack_array, pack_positions
from pdrom.core.store import write_text
from pdrom.core.yamlfile import ConfigModel, SceneName
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import mean_motion
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.subspace import exported
from pdrom.reduction.subspace.interpolation import interpolation_of
from pdrom.reduction.subspace.model import SubspaceModel, ecsw_name, load_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Settings
from study.experiments.kit import base as kit
from study.experiments.kit.base import experiment

log = logging.getLogger(__name__)

LARGEST = 3_000_000  # bytes of a file
GHOST = 250_000  # positions of the full-order run that a file holds, about
JOINT = "deim-joint"
FORMAT = 1
Labelled = tuple[dict[str, Any], SubspaceModel]


class LiveModels(ConfigModel):
    """Models of the page: numbers of modes k, tolerances of the sampling, and the modes r of the
    joint rows; each as far as the study has it."""

    sizes: tuple[kit.Modes, ...] = (10, 20, 40)
    tolerances: tuple[kit.Tolerance, ...] = (3e-2, 1e-2, 1e-3)
    joint_rows: kit.Modes = 20


class Live(LiveModels):
    """Section ``live``: the models of the page, and the ``scenes`` that a reader chooses from.

    Shown are those that the study has models of: position subspaces, or ``online.scenes``.
    """

    scenes: tuple[SceneName, ...] = ()


class OfScene(ConfigModel):
    """Names a file of a scene."""

    scene: str

    @property
    def labels(self) -> dict[str, str]:
        """Labels of the file."""
        return {"scene": self.scene}


class JointRows(ConfigModel):
    """Joint rows of a group, which the study has samples of."""

    scene: str
    group: str
    method: MethodSpec

    @property
    def labels(self) -> dict[str, str]:
        """Labels of the files of this case."""
        return {"scene": self.scene, "group": self.group, "method": JOINT}


class Options(ConfigModel):
    """Settings of the models of a scene."""

    scene: SceneConfig
    title: str
    live: LiveModels
    joint_rows: tuple[JointRows, ...]


@experiment(
    "Models of {scene} for the page",
    reads={
        "mesh": paths.MESH,
        "train": paths.TRAIN,
        "subspaces": EachOf(paths.SUBSPACES, "with_subspaces"),
        "online": EachOf(paths.ONLINE_MODELS, "with_online_models"),
        "bases": EachOf(paths.BASIS, "joint_rows"),
        "samplings": EachOf(paths.SAMPLING, "joint_rows"),
        "settings": Settings(Options),
    },
    writes={"out": paths.LIVE_MODEL},
)
def live(mesh: File, train: File, settings: Options, out: File, **files: list[File]) -> None:
    """Write the models with the recorded full-order run.

    Parameters
    ----------
    bases, samplings : of the joint rows, in the order of the settings

    Raises
    ------
    StorageError
        The file would be larger than `LARGEST`.
    """
    scene = kit.scene_of(settings.scene, mesh)
    reference = kit.positions_of(train)
    asked = settings.live
    chosen: list[Labelled] = []
    tolerances = {ecsw_name(tolerance): tolerance for tolerance in asked.tolerances}
    for file in (*files["subspaces"], *files["online"]):
        for own, model in load_models(file.path):
            method, kind, k = own["method"], own["position_basis"], own["k"]
            # models with sampled elements on snapshot bases
            if method in tolerances and kind == "pod" and k in asked.sizes:
                labels = {"family": "elements", "k": k, "tau": tolerances[method]}
                chosen.append((labels, model))
    given = (settings.joint_rows, files["bases"], files["samplings"])
    for case, file, sampling in zip(*given, strict=True):
        basis = load_basis(file.path)
        # of the size asked for, or of the largest that exists
        size = min(asked.joint_rows, basis.rank)
        reduction = kit.load_reduction(basis, sampling.path, case.method, size)
        chosen += list(_joint(scene, case.group, reduction, chosen))
    used, triangles = np.unique(scene.mesh.triangles, return_inverse=True)
    stride = max(1, ceil((len(reference) - 1) * len(used) / GHOST))
    content = {
        "format": FORMAT,
        "scene": settings.scene.name,
        "title": settings.title,
        **exported.export_scene(scene),
        **_models(scene, chosen),
        # the surface, and every so many frames of the full-order run at its vertices
        "shown": {
            "vertices": pack_array(used, "u4"),
            "triangles": pack_array(triangles.reshape(-1, 3), "u4"),
            "stride": stride,
            "full": pack_positions(reference[::stride, used]),
        },
        "motion": mean_motion(reference),
    }
    text = f"pdromLive({json.dumps(content, separators=(',', ':'), allow_nan=False)});\n"
    if len(text) > LARGEST:
        raise StorageError(
            f"{out.path}: {len(text) / 1e6:.1f} MB, allowed are {LARGEST / 1e6:.1f}: choose fewer "
            "sizes or tolerances (keys live.sizes, live.tolerances)"
        )
    write_text(text, out.path)
    log.info("%s: %d models, %.1f MB", settings.scene.name, len(chosen), len(text) / 1e6)


def _joint(
    scene: Scene, group: str, reduction: Reduction, beside: list[Labelled]
) -> Iterator[Labelled]:
    """Joint rows of a group for each subspace of the models ``beside``; others as sampled there."""
    for model in {id(model.columns): model for _, model in beside}.values():
        joint = interpolation_of(scene.group(group), model.columns, reduction)
        labels = {"family": "joint", "k": model.columns.modes, "r": reduction.r}
        samples = {**model.samples, group: joint}
        yield labels, SubspaceModel(model.position_basis, model.columns, samples)


def _models(scene: Scene, chosen: list[Labelled]) -> dict[str, Any]:
    """Bases and models; a model knows the place of its basis."""
    by_basis: dict[int, list[SubspaceModel]] = {}
    for _, model in chosen:
        by_basis.setdefault(id(model.columns), []).append(model)
    places = {key: place for place, key in enumerate(by_basis)}
    return {
        "bases": [
            exported.export_basis(scene, own[0].columns, exported.needed_vertices(scene, own))
            for own in by_basis.values()
        ],
        "models": [
            {**labels, "basis": places[id(model.columns)], **exported.export_model(scene, model)}
            for labels, model in chosen
        ],
    }
