"""Run an ablation (table ``ladder``) that turns the published method into a sound one in steps."""

import logging
from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from pdrom.model.metrics import relative_errors
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row
from study.experiments.repetitions.runs import ReducedRuns, Repetitions

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "direction", "rung", "rows_per_element", "entries", "r", "condition", "gain",
    "error_train", "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon",
    "repetitions", "error_median", "error_low", "error_high", "gain_low", "gain_high",
]  # fmt: skip
Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class Ladder(Repetitions):
    """Ablation steps: methods that differ in one choice, or combine two choices (``square``).

    r : basis size of all ablation steps (the numerical rank if that is smaller)
    signs : number of repetitions of the first step with other signs of the singular vectors
    repeated : scenes whose runs are repeated with other training frames
    up : methods from the published method on, each with one more change; the last is called sound
    down : methods that differ from the sound method in one choice each
    square : methods with separate or shared coefficients and with sampled rows or elements, one or
        more for each mode, each at all ``sizes``; p single rows replace an element of p rows, so
        that numbers of sampled entries are equal
    """

    r: Annotated[int, Field(ge=1, le=100_000)] = 20
    signs: Annotated[int, Field(ge=0, le=100)] = 0
    repeated: tuple[str, ...] = ()
    up: Rungs = ()
    down: Rungs = ()
    square: tuple[MethodSpec, ...] = ()
    sizes: tuple[kit.Modes, ...] = ()

    def rungs(self, p: int) -> list[tuple[str, MethodSpec, int | None, int]]:
        """List all runs as (direction; method; seed for the modes' signs or None; basis size r).

        A direction is "up", "down", "signs" or "square", see `Ladder`. Elements have ``p`` rows.
        """
        square = [
            method.model_copy(update={"oversampling": p * method.oversampling})
            if method.rows == "joint"
            else method
            for method in self.square
        ]
        return [
            *(("up", method, None, self.r) for method in self.up),
            *(("down", method, None, self.r) for method in self.down),
            *(("signs", self.up[0], seed, self.r) for seed in range(1, self.signs + 1)),
            *(("square", method, None, r) for r in self.sizes for method in square),
        ]


class LadderSection(Ladder):
    """Section ``ladder``: its methods are run for each reduced group of each of ``scenes``."""

    scenes: tuple[str, ...] = ()


def climb(runs: ReducedRuns, short: ReducedRuns, ladder: Ladder) -> Iterator[Row]:
    """Yield a row for each ablation step; ``short`` runs methods with other training frames.

    A method that occurs twice with equal size is run once.
    """
    p, known = runs.data.rows_per_element, dict[tuple[MethodSpec, int | None, int], Row]()
    for direction, method, seed, r in ladder.rungs(p):
        basis = runs.basis(method, signs=seed)
        if direction == "square" and r > basis.rank:
            continue
        size, rung = min(r, basis.rank), method.title if seed is None else f"signs {seed}"
        key = method.model_copy(update={"title": ""}), seed, size
        # without modes there is no reduction: all projections are rounding errors
        for reduction in reductions(basis, method, [size] if size else []).values():
            if key not in known:
                known[key] = _run(runs, reduction)
        row = {"direction": direction, "rung": rung, "r": r, "rows_per_element": p}
        row |= known.get(key, {})
        repeated = runs.full.scene.config.name in ladder.repeated
        if size and repeated and seed is None and direction != "square":
            row |= _scatter(short.repeat(method, [size], "training", ladder))
        yield row
        log.info("%s, %s", direction, rung)


def _run(runs: ReducedRuns, reduction: Reduction) -> Row:
    row, _ = runs.run(reduction)
    row["relative_error_within_horizon"] = row["error"] if np.isfinite(row["error"]) else None
    row["entries"] = sum(len(block.entries) for block in reduction.blocks)
    row["condition"] = reduction.condition
    for split in ("train", "heldout"):
        p = getattr(runs.data, split)
        found = relative_errors(p, reduction.reconstruct(p), runs.data.roundoff)
        row[f"error_{split}"] = found[0]
    return row


def _scatter(rows: list[Row]) -> Row:
    """Return the number of repetitions, and minimum, median and maximum of their results."""
    errors, gains = ([row[name] for row in rows] for name in ("error", "gain"))
    found = {"repetitions": len(rows), "error_median": float(np.median(errors))}
    found |= {"error_low": min(errors), "error_high": max(errors)}
    return found | {"gain_low": min(gains), "gain_high": max(gains)}
