"""Rule reruns: sampling of a group by one method, then the scene again with it reduced."""

from typing import Any

from pdrom.experiments.reruns import run_reduced
from pdrom.experiments.sampling import sample


def reduce_group(labels: dict[str, str], params: Any, inputs: Any, outputs: Any) -> None:
    """`sample`, then `run_reduced`, with the named parameters and files of the rule."""
    sample(
        labels,
        params.spec,
        params.sweep,
        params.ranks,
        inputs.snapshots,
        inputs.basis,
        outputs.sampling,
        outputs.errors,
    )
    run_reduced(
        labels,
        params.scene,
        params.spec,
        {"train": params.ranks, "heldout": params.heldout_ranks},
        params.blowup_extent,
        params.guard,
        params.solver,
        inputs.mesh,
        {"train": inputs.fom, "heldout": inputs.heldout},
        inputs.basis,
        outputs.sampling,
        outputs.runs,
        {"train": outputs.table, "heldout": outputs.heldout},
    )
