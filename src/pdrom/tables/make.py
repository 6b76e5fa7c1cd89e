"""Rules of the tables: files of the stages -> results/tables/*.csv."""

from pathlib import Path
from typing import Any

from pdrom.core.store import read_table, write_table, write_text
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.breakeven import breakeven
from pdrom.tables.budget import budget
from pdrom.tables.effects_cost import effects_cost, effects_left_out
from pdrom.tables.gain_prediction import gain_prediction
from pdrom.tables.ladder import ladder
from pdrom.tables.local_share import local_share
from pdrom.tables.online import online
from pdrom.tables.reconstruction_error import reconstruction_error
from pdrom.tables.reduced_reruns import heldout_reruns, reduced_reruns
from pdrom.tables.scaling import scaling, scaling_fit
from pdrom.tables.sensitivity import sensitivity
from pdrom.tables.singular_values import singular_values
from pdrom.tables.stability import stability
from pdrom.tables.subspace_ablation import subspace_ablation
from pdrom.tables.targets import targets


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
        "scaling": lambda: scaling(inputs.parts),
        "scaling_fit": lambda: scaling_fit(read_table(inputs.table)),
        "ladder": lambda: ladder(inputs.parts),
        "stability": lambda: stability(
            inputs.fom,
            inputs.reruns,
            inputs.hyper,
            inputs.sweeps,
            read_table(inputs.reduced_reruns),
            params.time_steps,
            params.wrong,
            params.left,
        ),
        "subspace_ablation": lambda: subspace_ablation(inputs.parts),
        "online": lambda: online(inputs.parts),
        "targets": lambda: targets(read_table(inputs.reruns), read_table(inputs.reconstruction)),
        "gain_prediction": lambda: gain_prediction(
            read_table(inputs.reruns), read_table(inputs.reconstruction)
        ),
        "accuracy_cost": lambda: accuracy_cost(
            read_table(inputs.reruns), inputs.timings, inputs.iterations, params.iterations
        ),
        "budget": lambda: budget(read_table(inputs.points), params.budgets),
        "breakeven": lambda: breakeven(inputs.parts),
        "effects_cost": lambda: effects_cost(inputs.parts),
        "effects_left_out": lambda: effects_left_out(inputs.parts),
    }
    if name not in makers:
        write_text(Path(inputs.part).read_text(encoding="utf-8"), output)
        return
    write_table(makers[name](), Path(output))
