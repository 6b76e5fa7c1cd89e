"""Tetrahedron deformation gradient: F goes to its nearest rotation (Bouaziz et al. 2014, 5.2)."""

from typing import Literal

import numpy as np

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.constraints.tetrahedron import TetrahedronGroup
from pdrom.model.mesh.types import Mesh


class DeformationGradient(TetrahedronGroup):
    """The clamp range [1, 1] leaves U V^T with det +1, the nearest rotation of F."""

    class Config(GroupConfig):
        """Weight w per volume, N/m^2."""

        effect: Literal["deformation_gradient"] = "deformation_gradient"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.minimum = self.maximum = 1.0
        self._set_up(mesh)
