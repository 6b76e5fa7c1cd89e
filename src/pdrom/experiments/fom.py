"""Rule fom: a full-order run with the snapshots that the scene's experiments need."""

from typing import Any

from pdrom.core.provenance import attributes
from pdrom.experiments.scenes import scene_of
from pdrom.model.runs.full_order import run as run_full_order
from pdrom.reduction.snapshots import stored_frames, test_frames


def run_fom(
    config: dict[str, Any], mesh: str, run: str, solver: str, threads: int, output: str
) -> None:
    """Simulate ``run`` of a scene; the held-out run stores the odd frames only."""
    scene = scene_of(config, mesh, run, threads)
    frames = scene.config.frames
    wanted = {
        group: test_frames(frames) if run == "heldout" else stored_frames(frames, plan.train)
        for group, plan in scene.config.reduce.items()
    }
    metadata = attributes({"scene": config, "run": run, "solver": solver})
    run_full_order(scene, output, wanted, metadata, solver)
