"""Bounds on reduced projections before a run: how far they carry, and whether they contract."""

import logging
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.local.contraction import Tangent, iteration_numbers
from pdrom.reduction.local.ranks import Rank, resolve_ranks
from pdrom.reduction.local.reach import reach
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction
from study.artifact.paths import BASIS, BOUNDS, MESH, SAMPLING, SENSITIVITY, TRAIN, File
from study.artifact.reads import Every, Settings
from study.experiments.kit.boundedness import Compliance, largest_projections, linear_extent
from study.experiments.kit.declaration import experiment
from study.experiments.kit.load_reduction import basis_of, load_reduction
from study.experiments.kit.premise import outside
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import Horizon

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "reach", "growth", "lasting_growth", "bound",
    "contraction", "spectral_radius",
]  # fmt: skip
# Dense matrices of all vertices are formed; a larger scene has empty cells.
MOST_VERTICES = 3000
# Where between the start and the horizon projections are linearised.
TANGENTS = (0.25, 0.75)


class Options(ConfigModel):
    """Settings of the bounds of a scene."""

    scene: SceneConfig
    methods: dict[str, MethodSpec]
    ranks: tuple[Rank, ...]
    horizon: Horizon


@experiment(
    "A-priori bounds of {scene}",
    reads={
        "mesh": MESH,
        "fom": TRAIN,
        "perturbed": SENSITIVITY,
        "bases": Every(BASIS),
        "samplings": Every(SAMPLING),
        "settings": Settings(Options),
    },
    writes={"out": BOUNDS},
)
def bounds(
    mesh: File,
    fom: File,
    perturbed: File,
    bases: list[File],
    samplings: list[File],
    settings: Options,
    out: File,
) -> None:
    """One row for every group, method and size that the basis holds."""
    scene = scene_of(settings.scene, mesh)
    if scene.mesh.vertices > MOST_VERTICES:
        log.warning("%d vertices: no bounds above %d", scene.mesh.vertices, MOST_VERTICES)
        write_table(pd.DataFrame([], columns=COLUMNS), out.path)
        return
    before = settings.horizon.frames(perturbed)
    case = _Case(scene, positions_of(fom), before)
    rows = [
        {**file.labels, "r": reduction.r, **case.numbers(file["group"], reduction)}
        for file, reduction in _reductions(settings, bases, samplings)
    ]
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _reductions(
    settings: Options, bases: list[File], samplings: list[File]
) -> Iterator[tuple[File, Reduction]]:
    loaded: dict[str, Basis] = {}
    for file in samplings:
        spec = settings.methods[file["method"]]
        path = basis_of(file, spec, bases).path
        basis = loaded.setdefault(path, load_basis(path))
        for r in resolve_ranks(settings.ranks, basis.rank):
            if r <= basis.rank:
                yield file, load_reduction(basis, file.path, spec, r=r)


def compliance(scene: Scene) -> Compliance | None:
    """Compliance of a scene; None, with a warning why, outside of the theorem's premise."""
    reason = outside(scene)
    if reason is None:
        return Compliance.of(scene)
    log.warning("scene '%s': no bounds: %s", scene.config.name, reason)
    return None


class _Case:
    """A scene with its compliance, the states at which it is linearised, and linear runs."""

    def __init__(self, scene: Scene, positions: np.ndarray, before: int) -> None:
        self._scene = scene
        self._compliance = compliance(scene)
        self._largest = _largest(scene)
        self._extents: dict[str, float] = {}
        self._tangents = list(_tangents(scene, positions, before))

    def numbers(self, group: str, reduction: Reduction) -> dict[str, Any]:
        """Cells of a row."""
        contraction = radius = None
        if self._tangents:
            contraction, radius = iteration_numbers(
                self._scene.group(group), reduction, self._tangents
            )
        bounds = self._bounds(group, reduction)
        return {**bounds, "contraction": contraction, "spectral_radius": radius}

    def _bounds(self, group: str, reduction: Reduction) -> dict[str, float]:
        # clipped coefficients are no linear image of the projections
        if self._compliance is None or reduction.spec.bounds != "none":
            return {}
        compliance, own = self._compliance, self._largest[group]
        energy = reach(self._scene.group(group), reduction, own, compliance.inverse)
        length = (energy + self._others(group)) * np.sqrt(compliance.softest)
        relative = length / self._scene.mesh.extent
        return {
            "reach": relative,
            "growth": compliance.growth,
            "lasting_growth": compliance.lasting,
            "bound": self._linear_extent(group, reduction.basis) + compliance.growth * relative,
        }

    def _others(self, group: str) -> float:
        """Bound of | S^T W p |_{K^+} of the groups that are not reduced: | p |_W, J^1/2."""
        squares = [
            float(g.weights @ self._largest[g.name] ** 2)
            for g in self._scene.groups
            if g.name != group
        ]
        return float(np.sqrt(sum(squares)))

    def _linear_extent(self, group: str, basis: Basis) -> float:
        """Largest extent of the run whose projections are the basis' mean, and zero elsewhere."""
        if basis.origin not in self._extents:
            g = self._scene.group(group)
            force = g.S.T @ (g.row_weights[:, None] * basis.mean.reshape(-1, 3))
            self._extents[basis.origin] = linear_extent(self._scene, force)
        return self._extents[basis.origin]


def _largest(scene: Scene) -> dict[str, np.ndarray]:
    """Bounds (e,) of the projections of each group that has them."""
    bounds = {g.name: largest_projections(g, scene.mesh.points) for g in scene.groups}
    return {name: bound for name, bound in bounds.items() if bound is not None}


def _tangents(scene: Scene, positions: np.ndarray, before: int) -> Iterator[Tangent]:
    """States of the full-order run; none in a scene of several groups, whose T has full rank."""
    if len(scene.groups) > 1:
        return
    (group,) = scene.groups
    matrix, space = scene.system.matrix.toarray(), scene.space(scene.system)
    for frame in sorted({int(share * before) for share in TANGENTS}):
        frame = min(frame, scene.config.frames - 1)
        held = space.fixed(frame, positions[frame])[0]
        yield Tangent.at(group, matrix, held, positions[frame], positions[frame + 1])
