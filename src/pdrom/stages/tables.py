"""Rules of the tables: files of the stages -> results/tables/*.csv."""

from pathlib import Path
from typing import Any

from pdrom.store import read_table, write_table
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.ladder import ladder
from pdrom.tables.local_share import local_share
from pdrom.tables.reconstruction_error import reconstruction_error
from pdrom.tables.reduced_reruns import heldout_reruns, reduced_reruns
from pdrom.tables.sensitivity import sensitivity
from pdrom.tables.singular_values import singular_values
from pdrom.tables.subspace_ablation import subspace_ablation


def make_table(name: str, inputs: Any, params: Any, output: str) -> None:
    """Write the table called ``name`` from the named inputs and parameters of its rule."""
    makers = {
        "singular_values": lambda: singular_values(inputs.bases),
        "reconstruction_error": lambda: reconstruction_error(inputs.errors),
        "sensitivity": lambda: sensitivity(inputs.scenes),
        "local_share": lambda: local_share(inputs.timings),
        "reduced_reruns": lambda: reduced_reruns(
            inputs.runs,
            inputs.hyper,
            inputs.timings,
            read_table(inputs.sensitivity),
            params.perturbation,
            params.threshold,
        ),
        "heldout_reruns": lambda: heldout_reruns(
            inputs.runs, inputs.hyper, read_table(inputs.sensitivity), params.threshold
        ),
        "ladder": lambda: ladder(inputs.parts),
        "subspace_ablation": lambda: subspace_ablation(inputs.parts),
        "accuracy_cost": lambda: accuracy_cost(
            read_table(inputs.reruns), inputs.timings, params.iterations
        ),
    }
    write_table(makers[name](), Path(output))
