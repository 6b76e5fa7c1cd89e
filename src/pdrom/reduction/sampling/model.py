"""Model of a scene with reduced projections of one constraint group and with all vertices."""

from dataclasses import dataclass

import h5py
import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.basis import store_basis, stored_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.sampling.reduction import Reduction, Sampling


@dataclass(frozen=True)
class ProjectionModel:
    """Reduced model: ``reduction`` of the projections of the constraint group named ``group``."""

    group: str
    reduction: Reduction

    @property
    def title(self) -> str:
        """Group, method, number of modes and DEIM constant, in words."""
        own = self.reduction
        return f"{self.group}, {own.spec.title}, r = {own.r}, DEIM constant {own.gain:.3g}"

    @property
    def residual(self) -> None:
        """None, as no training equations are fitted."""

    def elements_evaluated(self, scene: Scene) -> int:
        """Count the elements of ``scene`` whose projections an iteration evaluates."""
        others = sum(group.elements for group in scene.groups if group.name != self.group)
        return others + len(self.reduction.elements)

    def loop(self, scene: Scene) -> tuple[Stepper, State]:
        """Return the step loop of ``scene`` with the group reduced, and the initial state."""
        step = ReducedLocalStep(scene.group(self.group), self.reduction)
        steps = replace_group(scene, self.group, step)
        loop = scene.stepper(local_steps=steps, track_objective=False)
        return loop, scene.initial_state()

    def positions(self, y: np.ndarray) -> np.ndarray:
        """Return vertex positions (N, 3) m, which are the unknowns ``y``."""
        return y

    def output(self) -> None:
        """Return None, as the unknowns are the positions."""

    def store(self, file: h5py.Group) -> None:
        """Write the model to the HDF5 group ``file``."""
        own, labels = self.reduction, {"group": self.group, "r": self.reduction.r}
        file.attrs.update(labels | {"method": own.spec.model_dump_json()})
        store_basis(own.basis, file.create_group("basis"))
        file["entries"], file["elements"] = own.sampling.entries, own.sampling.elements

    @classmethod
    def stored(cls, file: h5py.Group) -> "ProjectionModel":
        """Read the model from the HDF5 group ``file``."""
        spec = MethodSpec.model_validate_json(file.attrs["method"])
        sampling = Sampling(file["entries"][...], file["elements"][...])
        basis, r = stored_basis(file["basis"], str(file.file.filename)), int(file.attrs["r"])
        return cls(str(file.attrs["group"]), Reduction(basis, sampling, spec, r=r))
