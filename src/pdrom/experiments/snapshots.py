"""Rule snapshots: two runs -> train, test and held-out snapshots of one group."""

from typing import Any

from pdrom.core.provenance import attributes
from pdrom.experiments.scenes import scene_of
from pdrom.reduction.snapshots import collect, save_snapshots, training_frames


def collect_snapshots(
    config: dict[str, Any], group: str, mesh: str, training_run: str, heldout_run: str, output: str
) -> None:
    """Split the stored projections of ``group`` and save them."""
    scene = scene_of(config, mesh)
    train = training_frames(scene.config.frames, scene.config.reduce[group].train)
    snapshots = collect(training_run, heldout_run, scene.group(group), scene.masses, train)
    save_snapshots(snapshots, output, attributes({"scene": config, "group": group}))
