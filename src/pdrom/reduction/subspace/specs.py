"""Settings of the interpolations in a position subspace."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pdrom.core.yamlfile import ConfigModel

Gain = Annotated[float, Field(gt=1.0)]


class HrpdSpec(ConfigModel):
    """Sampled constraints with interpolation (Brandt et al. 2018).

    dimension : dimension of the space of projections (fewer if there are fewer)
    samples : sampled elements (all, if there are fewer)
    """

    dimension: Annotated[int, Field(ge=1, le=10_000)] = 60
    samples: Annotated[int, Field(ge=1, le=1_000_000)] = 250


class InterpolationVariant(ConfigModel):
    """Block DEIM in a position subspace, of any size; the default is the plain method.

    states : what the basis is trained on: "full-order" positions, these "projected" on the
        subspace, or the last iterates that a run with full projections in the subspace "visited"
    interpolates : the "projection" p; what it adds to the strain, the "residual" p - S q; or
        "both", p and S q by the same basis of projections: the same operator on both sides
    centring : "affine" subtracts the mean and adds it back online
    oversampling : elements per mode
    gain : bound up to which elements are added (beyond ``oversampling``); None for no bound
    refuse_above : gain above which the basis is refused with an error; None refuses nothing
    test : the space that the projections are tested with: the strains of the "subspace", or
        "interpolated" strains (Galerkin; symmetric together with "both")
    margin : online coefficients stay in the range seen in training, widened on both sides by this
        fraction of it; None for no bounds
    safeguard : tolerance tau of the energy-conserving sampling whose objective no frame may raise;
        None for no safeguard
    """

    states: Literal["full-order", "projected", "visited"] = "full-order"
    interpolates: Literal["projection", "residual", "both"] = "projection"
    centring: Literal["none", "affine"] = "none"
    oversampling: Annotated[int, Field(ge=1, le=100)] = 1
    gain: Gain | None = None
    refuse_above: Gain | None = None
    test: Literal["subspace", "interpolated"] = "subspace"
    margin: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    safeguard: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None

    @model_validator(mode="after")
    def _combination_exists(self) -> Self:
        if self.test == "interpolated" and self.centring == "affine":
            raise ValueError("test = 'interpolated' with centring = 'affine': only 'none'")
        if self.interpolates == "both" and (self.centring, self.margin) != ("none", None):
            raise ValueError("interpolates = 'both' with centring or margin: neither is possible")
        return self


class InterpolationSpec(InterpolationVariant):
    """A variant with its basis size r, ``modes`` (the numerical rank where that is smaller)."""

    modes: Annotated[int, Field(ge=1, le=10_000)] = 20
