"""Milliseconds a frame of a scene's auxiliary model, beside the full-order run in the same job."""

import pandas as pd

from pdrom.artifact.reads import Setting
from pdrom.core.paths import COMPANION, COMPANION_TIMES, MESH, File
from pdrom.core.store import write_table
from pdrom.experiments.kit.declaration import experiment
from pdrom.experiments.kit.measurement import Protocol, Variant, measure
from pdrom.experiments.kit.scenes import scene_of
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.store import load_models

COLUMNS = ["scene", "elements_sampled", "companion_ms", "full_ms"]


@experiment(
    "Times of the auxiliary model of {scene}",
    reads={
        "mesh": MESH,
        "companion": COMPANION,
        "config": Setting("scene"),
        "timing": Setting("timing"),
    },
    writes={"out": COMPANION_TIMES},
    alone=True,
)
def companion_times(
    mesh: File, companion: File, config: SceneConfig, timing: Protocol, out: File
) -> None:
    """Time both in turn and write the table ``out``."""
    scene = scene_of(config, mesh)
    ((_, model),) = load_models(companion.path)
    frames = min(timing.frames, scene.config.frames)
    full = scene.stepper(track_objective=False)
    variants = [
        Variant({}, *model.loop(scene), frames),
        Variant({}, full, scene.initial_state(), frames),
    ]
    times = [measured.frame for measured in measure(variants, timing.warmup, timing.repeats)]
    row = [scene.config.name, model.elements_evaluated(scene), *times]
    write_table(pd.DataFrame([row], columns=COLUMNS), out.path)
