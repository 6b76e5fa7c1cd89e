"""Tetrahedron deformation gradient: F goes to its nearest rotation (Bouaziz et al. 2014, 5.2)."""

from typing import Literal

from pdrom.model.constraints.base import GroupConfig
from pdrom.model.constraints.tetrahedron import TetrahedronGroup


class DeformationGradient(TetrahedronGroup):
    """The clamp range [1, 1] leaves U V^T with det +1, the nearest rotation of F."""

    class Config(GroupConfig):
        """Weight w per volume, N/m^2."""

        effect: Literal["deformation_gradient"] = "deformation_gradient"

    allowed = (1.0, 1.0)
