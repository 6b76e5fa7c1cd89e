"""Outcome of a reduction in a hard case."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pdrom.core.errors import NotReducibleError, PdromError
from pdrom.reduction.method import MethodSpec
from study.experiments.hard_cases.case import HardCase
from study.experiments.hard_cases.checks import momentum, reach
from study.experiments.hard_cases.expectations import (
    FAILURES,
    HOLDS,
    NOT_TAKEN,
    NOTHING,
    Expectation,
)
from study.experiments.hard_cases.reductions import ReducedRun, Training, names, reduced_run

# Multiples of the full-order run's scale: a larger extent is a blow-up, or a distorted shape.
BLOWUP, DISTORTED = 100.0, 3.0
# Manifolds that are bounded: no projection onto them exceeds a number known before the run.
BOUNDED = ("clamped", "length", "half sphere")


def scale_of(training: Training) -> float:
    """Largest extent of the full-order run of ``training``, of rest, start and held vertices, m."""
    return max(training.run.extent, reach(training.scene, training.run))


def outcome_of(case: HardCase, training: Training, reduced: ReducedRun) -> str:
    """One of `HOLDS`, `NOTHING`, `FAILURES`: the first that applies to ``reduced`` of ``case``."""
    run = reduced.run
    if run is None:
        return NOTHING
    if reduced.gain == np.inf:
        return "singular"
    if run.blowup_frame is not None:
        return "blow-up"
    if run.extent > DISTORTED * scale_of(training):
        return "distorted"
    # in a position subspace the objective has to fall in every iteration, as in the full order;
    # interpolated projections of unreduced positions do not guarantee it
    if reduced.k is not None and run.excess.max() > 0.0:
        return "objective rises"
    # S^T W p sums to zero whatever p is
    if "momentum" in case.holds and momentum(case, training.scene, run):
        return "momentum changes"
    return HOLDS


def rows(
    case: HardCase, methods: Mapping[str, MethodSpec], expected: Mapping[str, Expectation]
) -> Iterator[dict[str, Any]]:
    """Rows of the table hard_cases: every reduction of ``methods`` in ``case``.

    ``expected`` says which of them fail.
    """
    training = Training(case)
    bounded = training.group.manifold in BOUNDED
    for name in names(methods):
        named = {"case": case.name, "method": name, "bounded_projections": bounded}
        yield {**named, **row(training, name, methods, expected=expected)}


def row(
    training: Training,
    name: str,
    methods: Mapping[str, MethodSpec],
    expected: Mapping[str, Expectation],
) -> dict[str, Any]:
    """Row of the reduction ``name``: sizes, what the run did, its outcome, why it failed."""
    entry = expected.get(name)
    extent = scale_of(training)
    try:
        reduced = reduced_run(training, name, methods, limit=BLOWUP * extent)
    except NotReducibleError as error:
        return {"frames": 0, "outcome": NOT_TAKEN, "why": str(error)}
    except PdromError as error:
        return {"frames": 0, "finite": False, "outcome": "refused", "why": str(error)}
    outcome = outcome_of(training.case, training, reduced)
    sizes = {"k": reduced.k, "r": reduced.r, "gain": reduced.gain}
    if reduced.run is None:
        return {**sizes, "frames": 0, "outcome": outcome, "why": "projections are round-off"}
    run = reduced.run
    return {
        **sizes,
        "frames": len(run.rise),
        "finite": run.blowup_frame is None,
        "blowup_frame": run.blowup_frame,
        "max_extent": run.extent / extent,
        "objective_rise": float(run.rise.max(initial=0.0)),
        "outcome": outcome,
        "why": entry.why if entry and outcome in FAILURES else "",
    }
