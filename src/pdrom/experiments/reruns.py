"""Rule reruns, second part: the scene with one group's projections reduced, for every asked r."""

import logging
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.provenance import attributes
from pdrom.core.store import open_hdf5, write_hdf5, write_table
from pdrom.experiments.scenes import RUNS, scene_of
from pdrom.model.energy import EnergyScale
from pdrom.model.scene import Scene
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.local.guard import GUARD_COLUMNS, GuardRecord, largest_extent
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.guarded import guarded_rerun
from pdrom.reduction.local.ranks import resolve_ranks
from pdrom.reduction.local.rerun import Rerun, displacement_norms
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.load import load_reduction

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "frames", "finite", "blowup_frame", "max_extent",
    "relative_error", "energy_ratio", "gain", *GUARD_COLUMNS,
]  # fmt: skip


def run_reduced(
    labels: dict[str, str],
    scene: dict[str, Any],
    spec: dict[str, Any],
    ranks: dict[str, list[int | str]],
    blowup_extent: float,
    guard: dict[str, Any],
    solver: str,
    mesh: str,
    runs: dict[str, str],
    basis: str,
    sampling: str,
    runs_output: str,
    tables: dict[str, str],
) -> None:
    """Rerun the scene for every r, on the training motion and on the held-out one.

    Parameters
    ----------
    ranks, runs, tables : for "train" and "heldout" the sizes to run, the full-order run to compare
        with, and the table to write
    """
    method, space = MethodSpec.model_validate(spec), load_basis(basis)
    watch = GuardSettings.model_validate(guard)
    with open_hdf5(runs["train"]) as file:
        trained_extent = largest_extent(file["positions"][...])
    with write_hdf5(runs_output) as file:
        file.attrs.update(attributes({**labels, "spec": spec, "scene": scene}))
        for motion in RUNS:
            bound = scene_of(scene, mesh, motion)
            case = _Case(bound, motion, labels, method, space, sampling, watch, trained_extent)
            store = file if motion == "train" else file.create_group(motion)
            rows = case.run(store, ranks[motion], runs[motion], blowup_extent, solver)
            table = pd.DataFrame(rows, columns=COLUMNS)
            whole = ["guard_frame", "guard_count", "fallback_frames"]
            write_table(table.astype(dict.fromkeys(whole, "Int64")), tables[motion])


@dataclass(frozen=True)
class _Case:
    """One motion of a scene with one method."""

    scene: Scene
    motion: str
    labels: dict[str, str]
    method: MethodSpec
    basis: Basis
    sampling: str
    guard: GuardSettings
    trained_extent: float

    def run(
        self, file: h5py.Group, ranks: list[int | str], fom: str, limit: float, solver: str
    ) -> list[dict[str, Any]]:
        """Rerun for every r and return the rows; an r beyond the rank is a marked row."""
        with open_hdf5(fom) as full_order:
            reference = full_order["positions"][...]
        displacement = displacement_norms(reference)
        scale = EnergyScale.of(self.scene, reference)
        file["displacement"] = displacement
        system = self.scene.system_with(solver)
        rows = []
        for r in resolve_ranks(ranks, self.basis.rank):
            store = file.create_group(f"r{r:04d}")
            store.attrs.update(r=r, full=r == self.basis.rank, marked=r > self.basis.rank)
            if r > self.basis.rank:
                log.warning("r = %d exceeds the numerical rank %d: not run", r, self.basis.rank)
                rows.append({**self.labels, "r": r, "frames": 0})
                continue
            reduction = load_reduction(self.basis, self.sampling, self.method, r)
            outcome, seen = guarded_rerun(
                self.scene, system, self.labels["group"], reduction, reference, limit,
                self.guard, self.trained_extent,
            )  # fmt: skip
            energy = scale.ratio(outcome.positions)
            _store(store, outcome, displacement, seen)
            if self.motion == "train":
                store["positions"] = outcome.positions.astype(np.float32)
            measured = {"energy_ratio": energy, "gain": reduction.gain, **seen.columns()}
            rows.append({**self.labels, "r": r, **_row(outcome, displacement), **measured})
            log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)
        return rows


def _store(store, outcome: Rerun, displacement: np.ndarray, seen: GuardRecord) -> None:
    store["difference"] = outcome.difference
    store["error"] = outcome.difference / np.sqrt(np.mean(displacement**2))
    store["extent"] = outcome.extent
    blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
    store.attrs.update(
        finite=outcome.blowup_frame is None, blowup_frame=blowup, max_extent=outcome.max_extent
    )
    store.attrs.update({k: v for k, v in seen.columns().items() if v is not None})


def _row(outcome: Rerun, displacement: np.ndarray) -> dict[str, Any]:
    finite = outcome.blowup_frame is None
    whole = finite and outcome.frames == len(displacement)
    return {
        "frames": outcome.frames,
        "finite": finite,
        "blowup_frame": outcome.blowup_frame,
        "max_extent": outcome.max_extent,
        "relative_error": trajectory_error(outcome.difference, displacement) if whole else None,
    }
