"""Rule hyper: position subspaces with full projections and with sampled elements."""

import logging
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.provenance import attributes
from pdrom.core.store import open_hdf5, write_hdf5, write_table
from pdrom.experiments.scenes import RUNS, scene_of
from pdrom.model.energy import EnergyScale
from pdrom.model.scene import Scene
from pdrom.reduction.local.rerun import displacement_norms
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.hrpd import hrpd, sampled_space
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel, make_columns, sample_elements
from pdrom.reduction.subspace.rerun import rerun_model
from pdrom.reduction.subspace.specs import HrpdSpec, InterpolationSpec

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
    "max_extent", "relative_error", "energy_ratio",
]  # fmt: skip


def run_hyper(
    scene: dict[str, Any],
    settings: dict[str, Any],
    blowup_extent: float,
    mesh: str,
    runs: dict[str, str],
    runs_output: str,
    tables: dict[str, str],
) -> None:
    """Build every model of ``settings`` (bases, sizes, tolerances) and run both motions with it."""
    motions = {motion: Motion(scene_of(scene, mesh, motion), runs[motion]) for motion in RUNS}
    bound = motions["train"].scene
    frames = _training_frames(bound)
    training = training_positions(bound, motions["train"].reference)
    spaces = _sampled_spaces(bound, settings)
    rows: dict[str, list[dict[str, Any]]] = {motion: [] for motion in RUNS}
    with write_hdf5(runs_output) as file:
        file.attrs.update(attributes({"scene": scene, "settings": settings}))
        for motion, case in motions.items():
            file[f"displacement/{motion}"] = case.displacement
        for kind in settings["bases"]:
            for k in settings["sizes"]:
                columns = make_columns(bound, training, kind, k)
                base = f"{kind}_k{k:03d}"
                _store_columns(file.create_group(f"columns/{base}"), columns)
                pairs = _samplings(bound, columns, frames, kind, settings)
                if k in settings["interpolated_sizes"]:
                    more = _interpolations(bound, columns, training, kind, settings, spaces)
                    pairs = chain(pairs, more)
                for method, samples in pairs:
                    model = SubspaceModel(kind, columns, samples)
                    labels = {"method": method, "position_basis": kind, "k": k, "base": base}
                    store = file.create_group(f"models/{base}_{method}")
                    _store_model(store, labels, samples)
                    for motion, case in motions.items():
                        outcome = case.run(model, blowup_extent)
                        for name in ("coordinates", "difference", "extent"):
                            store[f"{motion}/{name}"] = outcome[name]
                        rows[motion].append(case.row(labels, samples, outcome))
                    log.info("%s %s: error %s", base, method, rows["train"][-1]["relative_error"])
    for motion in RUNS:
        write_table(pd.DataFrame(rows[motion], columns=COLUMNS), tables[motion])


def training_positions(scene: Scene, reference: np.ndarray) -> np.ndarray:
    """Positions after the training frames: the even ones that train the projections, too."""
    return reference[1:][_training_frames(scene)]


def _training_frames(scene: Scene) -> np.ndarray:
    count = max(plan.train for plan in scene.config.reduce.values())
    return training_frames(scene.config.frames, count)


def _samplings(scene, columns, frames, kind, settings):
    """(method, samples) pairs: full projections, and element sampling on the snapshot basis."""
    yield "full", {}
    if kind == "pod":
        tolerances = settings["tolerances"]
        found = sample_elements(scene, columns, frames, tolerances)
        for tolerance, samples in zip(tolerances, found, strict=True):
            yield f"ecsw-{tolerance:.0e}", samples


def _sampled_spaces(scene: Scene, settings: dict[str, Any]) -> dict[str, Any]:
    """Spaces of projections for hrpd, by group; they depend on the rest shape only."""
    if settings["hrpd"] is None:
        return {}
    spec = HrpdSpec.model_validate(settings["hrpd"])
    return {group.name: sampled_space(group, scene.mesh.points, spec) for group in scene.groups}


def _interpolations(scene, columns, training, kind, settings, spaces):
    """(method, interpolations) pairs: hrpd, and the trained ones on the snapshot basis."""
    if spaces:
        yield "hrpd", {g.name: hrpd(g, columns, spaces[g.name]) for g in scene.groups}
    if kind == "pod":
        states = Training(scene, columns, training)
        for method, plain in settings["interpolations"].items():
            spec = InterpolationSpec.model_validate(plain)
            yield method, interpolate(scene, columns, states, spec)


class Motion:
    """The training or the held-out motion of a scene, with its full-order run."""

    def __init__(self, scene: Scene, fom: str) -> None:
        self.scene = scene
        with open_hdf5(fom) as file:
            self.reference = file["positions"][...]
        self.displacement = displacement_norms(self.reference)
        self.scale = EnergyScale.of(scene, self.reference)

    def run(self, model: SubspaceModel, limit: float) -> dict[str, Any]:
        """Run a model; a blow-up ends the run and is recorded."""
        outcome, coordinates = rerun_model(self.scene, model, self.reference, limit)
        return {
            "coordinates": coordinates,
            "difference": outcome.difference,
            "extent": outcome.extent,
            "blowup_frame": outcome.blowup_frame,
            "energy_ratio": self.scale.ratio(outcome.positions),
        }

    def row(
        self,
        labels: dict[str, Any],
        samples: dict[str, Samples | Interpolation],
        outcome: dict[str, Any],
    ) -> dict[str, Any]:
        """Row of the table of this motion."""
        full = sum(group.elements for group in self.scene.groups)
        sampled = sum(len(chosen.elements) for chosen in samples.values()) if samples else full
        whole = outcome["blowup_frame"] is None
        error = trajectory_error(outcome["difference"], self.displacement) if whole else None
        return {
            "scene": self.scene.config.name,
            "group": "all",
            **labels,
            "r": sampled,
            "frames": len(outcome["difference"]),
            "finite": whole,
            "blowup_frame": outcome["blowup_frame"],
            "max_extent": float(outcome["extent"].max(initial=0.0)),
            "relative_error": error,
            "energy_ratio": outcome["energy_ratio"],
        }


def _store_columns(store, columns: Columns) -> None:
    store["B"], store["free"] = columns.B, columns.free
    store.attrs["modes"] = columns.modes
    for i, (atom, own) in enumerate(zip(columns.atoms, columns.atom_columns, strict=True)):
        store[f"atoms/{i:04d}/vertices"], store[f"atoms/{i:04d}/columns"] = atom, own


def _store_model(
    store, labels: dict[str, Any], samples: dict[str, Samples | Interpolation]
) -> None:
    store.attrs.update(labels)
    for name, chosen in samples.items():
        if isinstance(chosen, Interpolation):
            chosen.save(store.create_group(f"samples/{name}"))
            continue
        store[f"samples/{name}/elements"] = chosen.elements
        store[f"samples/{name}/factors"] = chosen.factors
