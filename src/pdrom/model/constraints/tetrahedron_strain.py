"""Tetrahedron strain: signed singular values of F clamped to a range (Bouaziz et al. 2014, 5.1)."""

from typing import Literal

import numpy as np

from pdrom.model.constraints.tetrahedron import TetrahedronGroup
from pdrom.model.constraints.triangle_strain import StrainConfig
from pdrom.model.mesh.types import Mesh


class TetrahedronStrain(TetrahedronGroup):
    """Clamps to [minimum, maximum] > 0: an inverted tetrahedron is turned right side out."""

    class Config(StrainConfig):
        """Weight w per volume, N/m^2."""

        effect: Literal["tetrahedron_strain"] = "tetrahedron_strain"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.minimum, self.maximum = config.minimum, config.maximum
        self._set_up(mesh)
