"""Rule reruns, second part: the scene with one group's projections reduced, for every asked r."""

import logging
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
import pandas as pd

from pdrom.basis import Basis, load_basis
from pdrom.fom.stepper import LocalStep
from pdrom.method import MethodSpec
from pdrom.metrics import trajectory_error
from pdrom.provenance import attributes
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.ranks import resolve_ranks
from pdrom.rom.rerun import Rerun, displacement_norms, replace_group, rerun
from pdrom.sampling.load import load_reduction
from pdrom.scene import Scene
from pdrom.stages.scenes import RUNS, scene_of
from pdrom.store import open_hdf5, write_hdf5, write_table

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "frames", "finite", "blowup_frame", "max_extent",
    "relative_error",
]  # fmt: skip


def run_reduced(
    labels: dict[str, str],
    scene: dict[str, Any],
    spec: dict[str, Any],
    ranks: dict[str, list[int | str]],
    blowup_extent: float,
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
    with write_hdf5(runs_output) as file:
        file.attrs.update(attributes({**labels, "spec": spec, "scene": scene}))
        for motion in RUNS:
            case = _Case(scene_of(scene, mesh, motion), motion, labels, method, space, sampling)
            store = file if motion == "train" else file.create_group(motion)
            rows = case.run(store, ranks[motion], runs[motion], blowup_extent, solver)
            write_table(pd.DataFrame(rows, columns=COLUMNS), tables[motion])


@dataclass(frozen=True)
class _Case:
    """One motion of a scene with one method."""

    scene: Scene
    motion: str
    labels: dict[str, str]
    method: MethodSpec
    basis: Basis
    sampling: str

    def run(
        self, file: h5py.Group, ranks: list[int | str], fom: str, limit: float, solver: str
    ) -> list[dict[str, Any]]:
        """Rerun for every r and return the rows; an r beyond the rank is a marked row."""
        with open_hdf5(fom) as full_order:
            reference = full_order["positions"][...]
        displacement = displacement_norms(reference)
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
            outcome = rerun(self.scene, system, self._local_steps(r), reference, limit)
            _store(store, outcome, displacement)
            if self.motion == "train":
                store["positions"] = outcome.positions.astype(np.float32)
            rows.append({**self.labels, "r": r, **_row(outcome, displacement)})
            log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)
        return rows

    def _local_steps(self, r: int) -> list[LocalStep]:
        group = self.scene.group(self.labels["group"])
        reduction = load_reduction(self.basis, self.sampling, self.method, r)
        return replace_group(self.scene, group.name, ReducedLocalStep(group, reduction))


def _store(store, outcome: Rerun, displacement: np.ndarray) -> None:
    store["difference"] = outcome.difference
    store["error"] = outcome.difference / np.sqrt(np.mean(displacement**2))
    store["extent"] = outcome.extent
    blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
    store.attrs.update(
        finite=outcome.blowup_frame is None, blowup_frame=blowup, max_extent=outcome.max_extent
    )


def _row(outcome: Rerun, displacement: np.ndarray) -> dict[str, Any]:
    whole = outcome.blowup_frame is None
    return {
        "frames": outcome.frames,
        "finite": whole,
        "blowup_frame": outcome.blowup_frame,
        "max_extent": outcome.max_extent,
        "relative_error": trajectory_error(outcome.difference, displacement) if whole else None,
    }
