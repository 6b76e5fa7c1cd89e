"""Rule stability: one scene over the time step and over the stiffness, by every method."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.store import write_table
from pdrom.experiments.scenes import scene_of
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.energy import EnergyScale
from pdrom.model.scene import Scene
from pdrom.model.variation import varied
from pdrom.pipeline.study import Stability
from pdrom.reduction.basis import load_basis
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.ranks import resolve_ranks
from pdrom.reduction.local.rerun import Rerun, displacement_norms, replace_group, rerun
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction
from pdrom.reduction.sampling.load import load_reduction
from pdrom.reduction.subspace.load import load_models
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.rerun import rerun_model

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "method", "r", "h", "stiffness_ratio", "finite", "blowup_frame", "max_extent",
    "energy_ratio", "gain", "group", "position_basis", "k", "frames", "relative_error",
]  # fmt: skip


def sweep(
    scene: dict[str, Any],
    methods: dict[str, dict[str, Any]],
    settings: dict[str, Any],
    blowup_extent: float,
    solver: str,
    mesh: str,
    bases: list[str],
    samplings: list[str],
    hyper: list[str],
    output: str,
) -> None:
    """Run the full order, every local reduction and the largest subspaces at every setting.

    Bases and samplings are those of the scene's own setting: how far do they carry?
    """
    bound, chosen = scene_of(scene, mesh), Stability.model_validate(settings)
    reductions = list(_reductions(methods, chosen.ranks, bases, samplings))
    models = [model for path in hyper for model in _largest(load_models(path))]
    rows = []
    for h, ratio in _settings(bound.config.time_step, chosen):
        limits = (chosen.min_frames, chosen.max_frames)
        config = varied(bound.config, h, ratio, chosen.duration, limits)
        case = _Case(Scene.build(config, bound.mesh), ratio, solver, blowup_extent)
        rows += case.rows(reductions, models)
        log.info("h = %g s, stiffness times %g: %d frames", h, ratio, config.frames)
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = ["r", "blowup_frame", "k", "frames"]
    write_table(table.astype(dict.fromkeys(whole, "Int64")), output)


def _settings(own: float, chosen: Stability) -> list[tuple[float, float]]:
    """(h, stiffness ratio) pairs: one of them at a time leaves the scene's own setting."""
    steps = sorted({own, *chosen.time_steps})
    ratios = sorted({1.0, *chosen.stiffness_ratios})
    return [(h, 1.0) for h in steps] + [(own, ratio) for ratio in ratios if ratio != 1.0]


@dataclass(frozen=True)
class _Local:
    """A reduction of one group; None where the basis has fewer modes."""

    group: str
    method: str
    r: int
    reduction: Reduction | None


def _reductions(
    methods: dict[str, dict[str, Any]], ranks: Any, bases: list[str], samplings: list[str]
) -> Iterator[_Local]:
    for path in map(Path, samplings):
        group, method = path.parent.name, path.stem
        spec = MethodSpec.model_validate(methods[method])
        place = (group, spec.basis_id)
        basis = load_basis(next(b for b in bases if (Path(b).parent.name, Path(b).stem) == place))
        for r in resolve_ranks(ranks, basis.rank):
            known = r <= basis.rank
            yield _Local(group, method, r, load_reduction(basis, path, spec, r) if known else None)


def _largest(
    models: list[tuple[dict[str, Any], SubspaceModel]],
) -> list[tuple[dict[str, Any], SubspaceModel]]:
    size = max(labels["k"] for labels, _ in models)
    return [(labels, model) for labels, model in models if labels["k"] == size]


class _Case:
    """The scene at one setting, with its full-order run."""

    def __init__(self, scene: Scene, ratio: float, solver: str, limit: float) -> None:
        self.scene, self.limit = scene, limit
        self.system: GlobalSystem = scene.system_with(solver)
        self.labels = {
            "scene": scene.config.name, "h": scene.config.time_step, "stiffness_ratio": ratio,
        }  # fmt: skip
        nothing = np.zeros((scene.config.frames + 1, *scene.mesh.points.shape))
        self.full_order = rerun(scene, self.system, scene.groups, nothing, limit)
        self.reference = self.full_order.positions
        self.displacement = displacement_norms(self.reference)
        self.scale = EnergyScale.of(scene, self.reference)

    def rows(
        self, reductions: list[_Local], models: list[tuple[dict[str, Any], SubspaceModel]]
    ) -> list[dict[str, Any]]:
        """Rows of the full order and, if that is finite, of everything else."""
        full = {"method": "full", "position_basis": "full"}
        rows = [self._row(full, self.full_order)]
        if self.full_order.blowup_frame is not None:
            log.warning("the full-order run blew up: nothing to compare with")
            return rows
        rows[0]["relative_error"] = 0.0
        for local in reductions:
            labels = {"group": local.group, "method": local.method, "r": local.r}
            labels["position_basis"] = "full"
            if local.reduction is None:
                rows.append({**self.labels, **labels, "frames": 0})
                continue
            step = ReducedLocalStep(self.scene.group(local.group), local.reduction)
            steps = replace_group(self.scene, local.group, step)
            outcome = rerun(self.scene, self.system, steps, self.reference, self.limit)
            rows.append(self._row({**labels, "gain": local.reduction.gain}, outcome))
        for labels, model in models:
            outcome, _ = rerun_model(self.scene, model, self.reference, self.limit)
            rows.append(self._row({"group": "all", **labels}, outcome))
        return rows

    def _row(self, labels: dict[str, Any], outcome: Rerun) -> dict[str, Any]:
        finite = outcome.blowup_frame is None
        return {
            **self.labels,
            **labels,
            "frames": outcome.frames,
            "finite": finite,
            "blowup_frame": outcome.blowup_frame,
            "max_extent": outcome.max_extent,
            "energy_ratio": self.scale.ratio(outcome.positions),
            "relative_error": trajectory_error(outcome.difference, self.displacement)
            if finite
            else None,
        }
