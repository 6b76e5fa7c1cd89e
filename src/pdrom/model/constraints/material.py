"""Materials in physical units, from which the weights of constraint groups are computed.

An isotropic elastic material has the energy mu |e|^2 + lambda / 2 (tr e)^2 per volume, with a small
strain e and Lamé's constants; a sheet in plane stress has it per area, times its thickness. On
elements of dimension d, a group with weight w has w / 2 |e|^2 if it allows only rotations, and
w / (2 d) (tr e)^2 if it allows only the size at rest. The weights are thus 2 mu and d lambda.
"""

from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from pdrom.core.yamlfile import shown
from pdrom.model.constraints.base import WeightFactor
from pdrom.model.effects.base import EffectConfig, effect_config

EXACT = {"minimum": 1.0, "maximum": 1.0}


class Solid(EffectConfig):
    """Young's modulus ``young``, Pa, and Poisson's ratio ``poisson`` of tetrahedra."""

    size: ClassVar[str] = "volume"  # group for the size of elements
    dimension: ClassVar[int] = 3
    allowed: ClassVar[dict[str, Any]] = {}  # range of the group itself

    young: Annotated[float, Field(ge=1e-6, le=1e15)]
    poisson: Annotated[float, Field(ge=0.0, lt=0.5)]
    factors: tuple[WeightFactor, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _without_weight(cls, data: dict[Any, Any]) -> dict[Any, Any]:
        for key in ("weight", *EXACT):
            if key in data:
                fault = "not allowed with young, poisson or thickness, which determine it"
                raise ValueError(f"{key} = {shown(data[key], 60)}: {fault}")
        return data

    def parts(self) -> tuple[EffectConfig, ...]:
        """Return the group and, unless its weight is 0, the group for volume or area."""
        own = self.allowed | {"effect": self.effect, "factors": self.factors}
        own["weight"] = getattr(self, "thickness", 1.0) * self.young / (1.0 + self.poisson)
        ratio = self.dimension * self.poisson / (1.0 - (self.dimension - 1) * self.poisson)
        other = own | EXACT | {"effect": self.size, "weight": ratio * own["weight"]}
        try:
            return tuple(effect_config(each, 0) for each in (own, other) if each["weight"])
        except ValueError as error:
            given = f"young = {self.young:g}, poisson = {self.poisson}"
            raise ValueError(f"effects: {given}: too stiff ({error})") from error


class Sheet(Solid):
    """Young's modulus, Poisson's ratio and ``thickness``, m, of triangles in plane stress."""

    size, dimension, allowed = "area", 2, EXACT
    thickness: Annotated[float, Field(ge=1e-12, le=1e6)]
