"""Rule sensitivity: how far runs of one scene drift apart that should be the same."""

from typing import Any

from pdrom.fom.sensitivity import sensitivity
from pdrom.stages.scenes import scene_of
from pdrom.store import write_table


def measure_sensitivity(
    config: dict[str, Any],
    mesh: str,
    perturbations: list[float],
    seeds: list[int],
    output: str,
) -> None:
    """Write the sensitivity table of a scene (all seeds)."""
    scene = scene_of(config, mesh)
    write_table(sensitivity(scene, tuple(perturbations), tuple(seeds)), output)
