"""Milliseconds a frame of a scene's auxiliary model, beside the full-order run in the same job."""

import pandas as pd

from pdrom.core.store import write_table
from pdrom.model.scene import SceneConfig
from pdrom.reduction.subspace.store import load_models
from study.artifact.paths import COMPANION, COMPANION_TIMES, MESH, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import Protocol, Variant, measure
from study.experiments.kit.scenes import scene_of

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
