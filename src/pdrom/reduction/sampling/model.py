"""Model of a scene with the projections of one constraint group reduced, all vertices kept."""

from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.sampling.reduction import Reduction


@dataclass(frozen=True)
class ProjectionModel:
    """Reduced model: ``reduction`` of the projections of the constraint group named ``group``."""

    group: str
    reduction: Reduction

    def elements_evaluated(self, scene: Scene) -> int:
        """Number of elements of ``scene`` whose projections an iteration evaluates."""
        others = sum(group.elements for group in scene.groups if group.name != self.group)
        return others + len(self.reduction.elements)

    def loop(self, scene: Scene) -> tuple[Stepper, State]:
        """Step loop of ``scene`` with the group reduced, and the initial state."""
        step = ReducedLocalStep(scene.group(self.group), self.reduction)
        steps = replace_group(scene, self.group, step)
        loop = scene.stepper(local_steps=steps, track_objective=False)
        return loop, scene.initial_state()

    def positions(self, y: np.ndarray) -> np.ndarray:
        """Vertex positions (N, 3) m: the unknowns ``y`` themselves."""
        return y

    def output(self) -> None:
        """None: there are no positions to compute."""
