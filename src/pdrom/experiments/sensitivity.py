"""Rule sensitivity: how far runs of one scene drift apart that should be the same."""

from typing import Any

import pandas as pd

from pdrom.core.store import write_table
from pdrom.experiments.scenes import scene_of
from pdrom.model.runs.sensitivity import heldout_floor, sensitivity


def measure_sensitivity(
    config: dict[str, Any],
    mesh: str,
    perturbations: list[float],
    reference: float,
    seeds: list[int],
    output: str,
) -> None:
    """Write the sensitivity table of a scene (all seeds), with the floor of its held-out motion."""
    table = sensitivity(scene_of(config, mesh), tuple(perturbations), tuple(seeds))
    heldout = heldout_floor(scene_of(config, mesh, "heldout"), reference, tuple(seeds))
    write_table(pd.concat([table, heldout], ignore_index=True), output)
