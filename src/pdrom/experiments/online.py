"""Rule online: one large scene, hyper-reduced, against its own full-order run in the same job.

Everything is made here and nothing is kept but the rows of the table: full-order runs of both
motions, columns from training frames, element sampling, reduced runs, and times. Full-order and
reduced steps are timed in turn by the protocol of `pdrom.experiments.measurement`.
"""

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.store import write_table
from pdrom.experiments.measurement import Variant, measure
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.local.rerun import displacement_norms
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "vertices", "elements", "position_basis", "k", "tau", "elements_sampled",
    "relative_error_train", "relative_error_heldout", "ms_per_frame", "ms_per_iteration",
    "fom_ms_per_frame", "speedup",
]  # fmt: skip


def run_online(
    scene: dict[str, Any],
    settings: dict[str, Any],
    protocol: dict[str, int],
    root: str,
    output: str,
) -> None:
    """Reduce a scene by every size and tolerance of ``settings`` and write its rows."""
    config = SceneConfig.model_validate(scene)
    mesh = config.mesh.build(Path(root))
    train = Scene.build(config, mesh)
    heldout = Scene.build(config.held_out_variant(), mesh)
    references = [trajectory(motion, track_objective=False) for motion in (train, heldout)]
    log.info("%s: full-order runs of %d vertices", config.name, mesh.vertices)
    frames = training_frames(config.frames, max(p.train for p in config.reduce.values()))
    rows, variants = [], []
    for kind in settings["bases"]:
        for k in settings["sizes"]:
            columns = make_columns(train, references[0][1:][frames], kind, k)
            found = sample_elements(train, columns, frames, settings["tolerances"])
            for tolerance, samples in zip(settings["tolerances"], found, strict=True):
                model = SubspaceModel(kind, columns, samples)
                errors = [
                    relative_error(motion, model, reference)
                    for motion, reference in zip((train, heldout), references, strict=True)
                ]
                count = sum(len(chosen.elements) for chosen in samples.values())
                rows.append(
                    {
                        "scene": config.name,
                        "vertices": mesh.vertices,
                        "elements": sum(group.elements for group in train.groups),
                        "position_basis": kind,
                        "k": k,
                        "tau": tolerance,
                        "elements_sampled": count,
                        "relative_error_train": errors[0],
                        "relative_error_heldout": errors[1],
                    }
                )
                variants.append(_variant(*model.loop(train), protocol, config))
                log.info("%s k=%d tau=%g: %d elements", kind, k, tolerance, count)
    stepper = train.stepper(track_objective=False)
    variants.append(_variant(stepper, train.initial_state(), protocol, config))
    *reduced, full = measure(variants, protocol["warmup"], protocol["repeats"])
    for row, measurement in zip(rows, reduced, strict=True):
        row["ms_per_frame"] = measurement.frame
        row["ms_per_iteration"] = measurement.frame / config.iterations
        row["fom_ms_per_frame"] = full.frame
        row["speedup"] = full.frame / measurement.frame
    write_table(pd.DataFrame(rows, columns=COLUMNS), output)


def relative_error(scene: Scene, model: SubspaceModel, reference: np.ndarray) -> float | None:
    """Relative error of a run against ``reference`` (F + 1, N, 3); None if it blows up."""
    loop, state = model.loop(scene)
    difference = np.empty(scene.config.frames)
    for frame in range(scene.config.frames):
        with np.errstate(over="ignore", invalid="ignore"):
            state, _ = loop.step(state, frame)
            moved = model.positions(state.positions) - reference[frame + 1]
            difference[frame] = np.linalg.norm(moved)
        if not np.isfinite(difference[frame]):
            return None
    return trajectory_error(difference, displacement_norms(reference))


def _variant(loop, state, protocol: dict[str, int], config: SceneConfig) -> Variant:
    return Variant({}, loop, state, min(protocol["frames"], config.frames))
