"""Materials in physical units: keys of a group in place of its weight, resolved to weights.

An isotropic elastic material has the energy mu |e|^2 + lambda / 2 (tr e)^2 per volume, with a small
strain e and Lamé's constants; a sheet in plane stress has it per area, times its thickness. On
elements of dimension d, a group with weight w has w / 2 |e|^2 if it allows only rotations, and
w / (2 d) (tr e)^2 if it allows only the size at rest. The weights are thus 2 mu and d lambda.
"""

from collections.abc import Collection
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from pdrom.core.yamlfile import shown
from pdrom.model.constraints.base import LARGEST, WeightFactor
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import EffectConfig

# Keys of a group that are 1 in a material.
EXACT = ("minimum", "maximum")


class Material(EffectConfig):
    """Young's modulus ``young``, Pa, and Poisson's ratio ``poisson`` in place of a weight."""

    size: ClassVar[str]
    """Name of the group of the size of elements."""
    dimension: ClassVar[int]
    """Dimension d of the elements."""

    young: Annotated[float, Field(ge=1e-6, le=1e15)]
    poisson: Annotated[float, Field(ge=0.0, lt=0.5)]
    factors: tuple[WeightFactor, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _without_weight(cls, data: Any) -> Any:
        for key in ("weight", *EXACT):
            if isinstance(data, dict) and key in data:
                fault = "not beside young, poisson or thickness, which set it"
                raise ValueError(f"{key} = {shown(data[key], 60)}: {fault}")
        return data

    @model_validator(mode="after")
    def _within_limits(self) -> Self:
        for group, weight in self.weights.items():
            if weight > LARGEST:
                given = f"young = {self.young:g}, poisson = {self.poisson:g}"
                fault = f"the weight of '{group}' is {weight:.3g}, allowed are at most {LARGEST:g}"
                raise ValueError(f"{given}: {fault}")
        return self

    @property
    def weights(self) -> dict[str, float]:
        """Weights of the group and of that of the size, by their names."""
        weight, d = self.young / (1.0 + self.poisson), self.dimension
        return {
            self.effect: weight,
            self.size: weight * d * self.poisson / (1 - (d - 1) * self.poisson),
        }

    def parts(self, beside: Collection[str]) -> tuple[EffectConfig, ...]:
        """Return the group, and the group of the size unless its weight is 0; see the base class."""
        if self.size in beside:
            fault = f"'{self.size}' beside the material of '{self.effect}', which sets it"
            raise ValueError(f"effects: {fault}; leave one of the two out")
        groups = {group: weight for group, weight in self.weights.items() if weight > 0.0}
        kinds = {group: EFFECTS.load(group).Config for group in groups}
        return tuple(
            kind(
                weight=groups[group],
                factors=self.factors,
                **{key: 1.0 for key in EXACT if key in kind.model_fields},
            )
            for group, kind in kinds.items()
        )


class Solid(Material):
    """Material of tetrahedra."""

    effect: Literal["deformation_gradient"] = "deformation_gradient"
    size, dimension = "volume", 3


class Sheet(Material):
    """Material of triangles in plane stress, with a ``thickness`` in metres."""

    effect: Literal["strain"] = "strain"
    size, dimension = "area", 2
    thickness: Annotated[float, Field(ge=1e-12, le=1e6)]

    @property
    def weights(self) -> dict[str, float]:
        return {group: self.thickness * weight for group, weight in super().weights.items()}
