"""Section ``alternatives``: methods, their steps, and what they are compared with."""

from typing import Annotated, Any, Final

from pydantic import AfterValidator, Field

from pdrom.core.errors import choices
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.held_out import FIRST, MOTIONS, HeldOutMotion
from study.experiments.alternatives.solvers.substeps import METHODS
from study.experiments.kit.base import Count, Modes, Repeats, Sizes, Tolerance
from study.experiments.kit.measurement import Processes

REDUCED, ACCELERATED = REDUCTIONS = "ecsw", "ecsw-anderson"  # the others are full-order ones
TWO_LEVEL: Final = "two-level"  # full order, with a trained subspace for its coarse level
TRAINED: Final = (TWO_LEVEL, *REDUCTIONS)
CONVERGED: Final = "converged"  # the implicit step solved to convergence
TRAINING: Final = "training"  # the runs that a reduction is trained on

# These columns together identify a candidate of a scene.
SETTING: Final = ["method", "substeps", "iterations", "training_motions", "k"]

Factors = Annotated[tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...], Field(min_length=1)]
Work = Annotated[int, Field(ge=1, le=10**12, description="vertices times steps")]
Steps = Annotated[tuple[Count, Count], Field(description="substeps of a frame, iterations of each")]


def _with_the_first(motions: tuple[HeldOutMotion, ...]) -> tuple[HeldOutMotion, ...]:
    if motions[:1] != (FIRST,):
        raise ValueError(f"begins with '{FIRST}', the one that is timed")
    return motions


def _known(by_method: dict[str, Any]) -> dict[str, Any]:
    allowed = (*METHODS, *TRAINED, CONVERGED, TRAINING)
    for name in by_method:
        if name not in allowed:
            raise ValueError(f"unknown method '{name}'{choices(name, allowed)}")
    return by_method


def _methods(steps: dict[str, Any]) -> dict[str, Any]:
    for name in {CONVERGED, TRAINING}.intersection(steps):
        raise ValueError(f"{name}: has no steps, only a limit of its work")
    return steps


# More iterations of one step, and more steps of one iteration. Other settings are slower.
STEPS: dict[str, tuple[Steps, ...]] = {
    "projective": (
        (1, 1), (1, 2), (1, 3), (1, 4), (1, 5), (1, 10), (1, 20), (1, 40), (1, 80),
        (2, 1), (5, 1), (10, 1), (20, 1), (40, 1), (5, 4),
    ),
    "anderson": ((1, 5), (1, 10), (1, 20), (1, 40), (1, 80), (5, 5), (10, 5)),
    "chebyshev": ((1, 10), (1, 20), (1, 40), (1, 80)),
    TWO_LEVEL: ((1, 2), (1, 3), (1, 5), (1, 10), (1, 20)),
    REDUCED: ((1, 5), (1, 10), (1, 20), (1, 40)),
    ACCELERATED: ((1, 5), (1, 10), (1, 20)),
}  # fmt: skip


class ContinuousReference(ConfigModel):
    """The motion in continuous time: explicit steps, halved from ``substeps`` a frame on.

    They are halved until the estimated error is below ``tolerance``, as long as the vertices times
    the steps of a frame are at most ``limit``.
    """

    substeps: Count = 40
    limit: Work = 2_400_000
    tolerance: Tolerance = 1e-4


class ImplicitReference(ConfigModel):
    """The implicit step of the scene: a frame is converged when one more local/global iteration
    moves no vertex by more than ``tolerance`` times the extent; ``limit`` bounds the evaluations.
    Runs that train a reduction stop at the larger ``training_tolerance``.
    """

    tolerance: Tolerance = 1e-7
    training_tolerance: Tolerance = 1e-5
    limit: Annotated[int, Field(ge=2)] = 4000


class Comparison(Processes):
    """Comparison of methods on one scene and one mesh.

    ``steps`` has pairs (substeps of a frame, iterations of each substep) for each method. Errors
    are taken over all frames of each of the held-out ``motions``. On its own mesh a scene runs with
    each of its factors on all weights in ``stiffness`` (1 if it has none). Each of ``processes``
    new processes times ``frames`` spread over the first motion. The reduction has each of ``modes``
    and samples elements to ``tau``; it is trained on each number of ``training_motions``, the first
    of which is that of the scene. The coarse level of two-level samples to ``coarse_tau`` and is
    trained on this one. ``work`` bounds vertices x substeps x iterations of a frame of a method,
    and vertices x motions of the ``training``; what is beyond it is left out.
    """

    stiffness: dict[str, Factors] = Field(default_factory=dict)
    steps: Annotated[
        dict[str, tuple[Steps, ...]], AfterValidator(_known), AfterValidator(_methods)
    ] = STEPS
    work: Annotated[dict[str, Work], AfterValidator(_known)] = Field(default_factory=dict)
    modes: Annotated[tuple[Modes, ...], Field(min_length=1)] = (40,)
    tau: Tolerance = 1e-2
    coarse_tau: Tolerance = 5e-3
    training_motions: Annotated[
        tuple[Annotated[int, Field(ge=1, le=64)], ...], Field(min_length=1)
    ] = (1, 2, 4, 8)
    implicit: ImplicitReference = ImplicitReference()
    continuous: ContinuousReference = ContinuousReference()
    motions: Annotated[tuple[HeldOutMotion, ...], AfterValidator(_with_the_first)] = MOTIONS
    frames: Count = 20
    repeats: Repeats = 1

    def factors(self, scene: str, size: float) -> tuple[float, ...]:
        """Factors on all weights of a scene with ``size`` times the vertices along a side."""
        return self.stiffness.get(scene, (1.0,)) if size == 1.0 else (1.0,)

    def pairs(self, method: str, vertices: int) -> list[tuple[int, int]]:
        """Pairs (substeps, iterations) with which ``method`` runs on a mesh of ``vertices``."""
        steps = self.steps.get(method, ())
        return [(n, k) for n, k in steps if self.affords(method, vertices * n * k)]

    def affords(self, method: str, work: int) -> bool:
        """Whether a frame of ``method`` may have ``work``, vertices x substeps x iterations."""
        return work <= self.work.get(method, work)


class Alternatives(Comparison):
    """Section ``alternatives``: factors on the vertices along a side for each of ``scenes``.

    The total mass does not depend on the factor. The table of winners has a row for each of
    ``errors``.
    """

    scenes: Sizes = Field(default_factory=dict)
    errors: tuple[Tolerance, ...] = (1e-1, 1e-2, 1e-3)
