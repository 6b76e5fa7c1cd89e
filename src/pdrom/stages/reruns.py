"""Rule reruns: the scene again, with one group's projections reduced, for every asked r."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.basis import load_basis
from pdrom.method import MethodSpec
from pdrom.metrics import trajectory_error
from pdrom.provenance import attributes
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.ranks import resolve_ranks
from pdrom.rom.rerun import Rerun, displacement_norms, replace_group, rerun
from pdrom.sampling.load import load_reduction
from pdrom.stages.scenes import scene_of
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
    ranks: list[int | str],
    blowup_extent: float,
    solver: str,
    mesh: str,
    fom: str,
    basis: str,
    sampling: str,
    runs_output: str,
    table_output: str,
) -> None:
    """Rerun the scene for every r; an r beyond the numerical rank is a marked row."""
    method, space = MethodSpec.model_validate(spec), load_basis(basis)
    bound = scene_of(scene, mesh)
    system = bound.system_with(solver)
    group = bound.group(labels["group"])
    with open_hdf5(fom) as file:
        reference = file["positions"][...]
    displacement = displacement_norms(reference)
    rows = []
    with write_hdf5(runs_output) as file:
        file.attrs.update(attributes({**labels, "spec": spec, "scene": scene}))
        file["displacement"] = displacement
        for r in resolve_ranks(ranks, space.rank):
            store = file.create_group(f"r{r:04d}")
            store.attrs.update(r=r, full=r == space.rank, marked=r > space.rank)
            if r > space.rank:
                log.warning("r = %d exceeds the numerical rank %d: not run", r, space.rank)
                rows.append({**labels, "r": r, "frames": 0})
                continue
            local = ReducedLocalStep(group, load_reduction(space, sampling, method, r))
            steps = replace_group(bound, group.name, local)
            outcome = rerun(bound, system, steps, reference, blowup_extent)
            _store(store, outcome, displacement)
            rows.append({**labels, "r": r, **_row(outcome, displacement)})
            log.info("r = %d: %d frames, blow-up %s", r, outcome.frames, outcome.blowup_frame)
    write_table(pd.DataFrame(rows, columns=COLUMNS), table_output)


def _store(store, outcome: Rerun, displacement: np.ndarray) -> None:
    store["positions"] = outcome.positions.astype(np.float32)
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
