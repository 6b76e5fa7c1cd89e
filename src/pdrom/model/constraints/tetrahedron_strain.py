"""Tetrahedron strain: signed singular values of F clamped to a range (Bouaziz et al. 2014, 5.1)."""

from typing import Literal

from pdrom.model.constraints.singular_values import StrainConfig
from pdrom.model.constraints.tetrahedron import TetrahedronGroup


class TetrahedronStrain(TetrahedronGroup):
    """Clamps to [minimum, maximum] > 0: an inverted tetrahedron is turned right side out."""

    class Config(StrainConfig):
        """Weight w per volume, N/m^2."""

        effect: Literal["tetrahedron_strain"] = "tetrahedron_strain"
