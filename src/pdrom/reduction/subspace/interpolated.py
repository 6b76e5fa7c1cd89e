"""States and bases that train the interpolations in a position subspace, and the result."""

from dataclasses import replace

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.block_deim import States, TrainedBasis, block_deim, train_basis
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.model import Samples, sample_elements
from pdrom.reduction.subspace.space import ReducedSpace, coordinates, reduced_state
from pdrom.reduction.subspace.specs import InterpolationSpec


def interpolate(
    scene: Scene, columns: Columns, training: "Training", spec: InterpolationSpec
) -> dict[str, Interpolation]:
    """Interpolation of every group of the scene; errors as `block_deim`.

    Parameters
    ----------
    spec : modes, states, oversampling, bounds
    """
    made = {g.name: block_deim(g, columns, training.basis(g, spec), spec) for g in scene.groups}
    if spec.safeguard is None:
        return made
    control = training.control(spec.safeguard)
    return {
        name: replace(chosen, control=control[name].elements, control_factors=control[name].factors)
        for name, chosen in made.items()
    }


class Training:
    """The states and bases of `InterpolationSpec`, each made once, when it is needed.

    Parameters
    ----------
    training : (n, N, 3) full-order positions of the training frames
    start : coordinates at which the training motion begins; where the scene does if None
    """

    def __init__(
        self, scene: Scene, columns: Columns, training: np.ndarray, start: State | None = None
    ) -> None:
        self._scene, self._columns, self._training = scene, columns, training
        self._start = start
        self._made: dict[str, States] = {}
        self._bases: dict[tuple[str, ...], TrainedBasis] = {}
        self._controls: dict[float, dict[str, Samples]] = {}
        self._makers = {
            "full-order": self._full_order,
            "projected": self._projected,
            "visited": self._visited,
        }

    def basis(self, group: ConstraintGroup, spec: InterpolationSpec) -> TrainedBasis:
        """Basis of what ``spec`` interpolates of a group."""
        key = (group.name, spec.states, spec.interpolates, spec.centring)
        if key not in self._bases:
            self._bases[key] = train_basis(group, self.states(spec.states), spec)
        return self._bases[key]

    def control(self, tolerance: float) -> dict[str, Samples]:
        """Energy-conserving samples of every group at ``tolerance`` tau for the safeguard."""
        if tolerance not in self._controls:
            frames = training_frames(self._scene.config.frames, len(self._training))
            found = sample_elements(self._scene, self._columns, frames, [tolerance], self._start)
            self._controls[tolerance] = found[0]
        return self._controls[tolerance]

    def states(self, kind: str) -> States:
        """States of a kind, as pairs (beginning of the frame, place of the projections)."""
        if kind not in self._made:
            self._made[kind] = self._makers[kind]()
        return self._made[kind]

    def _full_order(self) -> States:
        return [(q, q) for q in self._training]

    def _projected(self) -> States:
        b, masses = self._columns.B, self._scene.masses
        fields = [b @ coordinates(self._columns, masses, q) for q in self._training]
        return [(q, q) for q in fields]

    def _visited(self) -> States:
        """Last local iterates of a run with full projections, in as many (even) frames."""
        wanted = set(training_frames(self._scene.config.frames, len(self._training)).tolist())
        loop = _full_projections(self._scene, self._columns)
        state = self._start or reduced_state(self._scene, self._columns)
        b, visited, last = self._columns.B, [], []
        for frame in range(self._scene.config.frames):
            start = state.positions
            state, _ = loop.step(state, frame, on_last_iterate=lambda y: last.append(y.copy()))
            if frame in wanted:
                visited.append((b @ start, b @ last[-1]))
            last.clear()
        if not all(np.isfinite(y).all() for _, y in visited):
            raise SceneError(
                f"scene '{self._scene.config.name}': its run with full projections in the "
                "subspace is not finite: no states to train on"
            )
        return visited


def _full_projections(scene: Scene, columns: Columns) -> Stepper:
    """Step loop in the subspace with the projections of all elements."""
    steps = [SubspaceLocalStep(group, columns) for group in scene.groups]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    config = scene.config
    return Stepper(space, config.time_step, config.iterations, steps, track_objective=False)
