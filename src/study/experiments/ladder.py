"""The ladder: from the published choices to sound ones, one ingredient at a time."""

import logging
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.model.metrics import relative_errors
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots
from study.artifact.paths import LADDER, MESH, SENSITIVITY, SNAPSHOTS, TRAIN, File
from study.artifact.reads import Setting
from study.experiments.kit.declaration import experiment
from study.experiments.kit.repetition import ReducedRuns, Repetition, Repetitions
from study.experiments.kit.scenes import positions_of, scene_of
from study.experiments.kit.settings import BlowupExtent, Horizon, Modes

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "direction", "rung", "rows_per_element", "entries", "r", "condition", "gain",
    "error_train", "error_test",
    "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon", "repetitions",
    "error_median", "error_low", "error_high", "gain_low", "gain_high",
]  # fmt: skip
Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class Ladder(Repetitions):
    """The rungs of a ladder; runs are repeated on other training frames.

    r : basis size of all rungs (the numerical rank where that is smaller)
    signs : how many choices of the singular vectors' signs the first rung is repeated with
    repeated : scenes whose runs are repeated
    up, down : methods, from the published one upwards, and the sound one less one ingredient
    square : separate or shared coefficients on single rows or whole elements, at each of ``sizes``;
        rows are sampled p times as often as elements, which have p of them: as many entries
    """

    r: Annotated[int, Field(ge=1, le=100_000)] = 20
    signs: Annotated[int, Field(ge=0, le=100)] = 0
    repeated: tuple[str, ...] = ()
    up: Rungs = ()
    down: Rungs = ()
    square: tuple[MethodSpec, ...] = ()
    sizes: tuple[Modes, ...] = ()

    def rungs(self, p: int) -> list[tuple[str, MethodSpec, int | None, int]]:
        """(direction, method, seed of the signs, size) of all rows of a group, in order."""
        rows: list[tuple[str, MethodSpec, int | None, int]] = []
        rows += [("up", method, None, self.r) for method in self.up]
        rows += [("down", method, None, self.r) for method in self.down]
        rows += [("signs", self.up[0], seed, self.r) for seed in range(1, self.signs + 1)]
        square = [_as_many_entries(method, p) for method in self.square]
        return rows + [("square", method, None, r) for r in self.sizes for method in square]


class LadderSection(Ladder):
    """Section ``ladder``: the rungs, and ``scenes`` whose reduced groups are run with them."""

    scenes: tuple[str, ...] = ()


@experiment(
    "Ladder of {group} in {scene}",
    reads={
        "mesh": MESH,
        "fom": TRAIN,
        "snapshots": SNAPSHOTS,
        "sensitivity": SENSITIVITY,
        "config": Setting("scene"),
        "ladder": Setting("ladder"),
        "horizon": Setting("horizon"),
        "blowup_extent": Setting("blowup_extent"),
    },
    writes={"out": LADDER},
)
def ladder(
    mesh: File,
    fom: File,
    snapshots: File,
    sensitivity: File,
    config: SceneConfig,
    ladder: Ladder,
    horizon: Horizon,
    blowup_extent: BlowupExtent,
    out: File,
) -> None:
    """Reduce and rerun the scene with every rung."""
    labels, data = out.labels, load_snapshots(snapshots.path)
    runs = ReducedRuns(
        scene_of(config, mesh),
        labels["group"],
        data,
        reference=positions_of(fom),
        end=horizon.frames(sensitivity),
        blowup_extent=blowup_extent,
    )
    judged = runs.until_the_end() if labels["scene"] in ladder.repeated else None
    rows = []
    for direction, method, seed, r in ladder.rungs(data.rows_per_element):
        row = {**labels, "direction": direction, "rung": _name(method, seed), "r": r}
        row["rows_per_element"] = data.rows_per_element
        basis = runs.basis(method, signs=seed)
        if direction == "square" and r > basis.rank:
            continue
        size = min(r, basis.rank)
        # a group that is round-off has no reduction
        for reduction in reductions(basis, method, [size] if size else []).values():
            outcome = runs.run(reduction)
            row |= {**outcome.row(runs.displacement), "r": size, **_measures(reduction, data)}
            row["relative_error_within_horizon"] = runs.error(outcome)
            if judged is not None and seed is None and direction != "square":
                row |= _ranges(list(judged.repeat(method, [size], "training", ladder)))
        rows.append(row)
        log.info("%s, %s", direction, row["rung"])
    table = pd.DataFrame(rows, columns=COLUMNS)
    whole = dict.fromkeys(("blowup_frame", "repetitions", "entries"), "Int64")
    write_table(table.astype(whole), out.path)


def _as_many_entries(method: MethodSpec, p: int) -> MethodSpec:
    if method.rows != "joint":
        return method
    return method.model_copy(update={"oversampling": p * method.oversampling})


def _name(method: MethodSpec, seed: int | None) -> str:
    return method.title if seed is None else f"signs {seed}"


def _measures(reduction: Reduction, data: SnapshotSet) -> dict[str, Any]:
    errors = {}
    for split in SPLITS:
        p = getattr(data, split)
        errors[f"error_{split}"] = relative_errors(p, reduction.reconstruct(p), data.roundoff)[0]
    entries = sum(len(block.entries) for block in reduction.blocks)
    return {"entries": entries, "condition": reduction.condition, "gain": reduction.gain, **errors}


def _ranges(runs: list[Repetition]) -> dict[str, Any]:
    """Ranges over the repetitions; a run that ended before the horizon has an infinite error."""
    if not runs:
        return {}
    errors, gains = [run.error for run in runs], [run.gain for run in runs]
    return {
        "repetitions": len(runs),
        "error_median": float(np.median(errors)),
        "error_low": min(errors),
        "error_high": max(errors),
        "gain_low": min(gains),
        "gain_high": max(gains),
    }
