"""Reduction methods: each combines a basis, a kind of samples, a selection rule and a solver.

The file methods.yaml names the combinations. A selection rule's module is imported on first use.
"""

import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.registry import Registry
from pdrom.core.yamlfile import ConfigModel, read_yaml, shown, validate

SELECTIONS = Registry(
    "selection",
    {
        "greedy": "pdrom.reduction.sampling.greedy:Greedy",
        "pivoted-qr": "pdrom.reduction.sampling.qdeim:PivotedQR",
        "s-opt": "pdrom.reduction.sampling.s_opt:SOpt",
    },
)


METHOD_NAME = "[a-z0-9][a-z0-9-]{0,63}"
Solve = Literal["square", "qr", "tikhonov"]


class BasisSpec(ConfigModel):
    """Recipe of a basis from snapshots.

    weighting : "mass" makes modes orthonormal in the inner product with the lumped mass of each row
    centring : "affine" subtracts the mean, and reconstructions add it; "mean-in-modes" follows the
        program published with the preprint: it subtracts the first snapshot, rescales the modes,
        adds that snapshot to every mode and orthogonalises the modes again per axis
    layout : "vectorised" stacks x, y, z of a snapshot in one column, so that they share the
        coefficients; "per-axis" makes one basis for each of x, y, z
    """

    weighting: Literal["none", "mass"] = "none"
    centring: Literal["none", "affine", "mean-in-modes"] = "none"
    layout: Literal["vectorised", "per-axis"] = "vectorised"

    @property
    def basis_id(self) -> str:
        """Name of this basis recipe, made of its three settings; part of the basis file's path."""
        return f"{self.weighting}-{self.centring}-{self.layout}"

    @property
    def separate_axes(self) -> bool:
        """Whether the modes are orthonormal on each axis instead of as whole vectors."""
        return self.layout == "per-axis" or self.centring == "mean-in-modes"


class MethodSpec(BasisSpec):
    """A method that reduces the projections of one constraint group.

    rows : "all" (orthogonal projection), "scalar" samples single entries (classical DEIM), "joint"
        one shared row for x, y, z with separate coefficients (the preprint's selection), "element"
        all 3p entries of an element of p rows
    selection : name in `SELECTIONS`, such as "greedy" (largest residual, as in DEIM)
    solve : solution of the sampled equations: "square", least squares by "qr", or normal equations
        with Tikhonov term ("tikhonov", as in the program published with the preprint)
    oversampling : samples per mode; those in excess of one are selected by S-OPT if that is the
        ``selection``, otherwise by GappyPOD+E
    gain_bound : samples are added (GappyPOD+E) until the DEIM constant, the factor by which
        sampling can amplify the error of the best approximation, is at most this; None: no bound
    coefficients : "shared" by x, y, z or "per-axis"; None: as ``rows`` and the basis imply
    repeat_rows : whether the greedy selection may repeat a row, as in the preprint authors' program
    title : name of the method in figures and tables
    """

    title: str
    rows: Literal["all", "scalar", "joint", "element"]
    selection: str = "greedy"
    solve: Solve = "qr"
    repeat_rows: bool = False
    oversampling: Annotated[int, Field(ge=1, le=100)] = 1
    gain_bound: Annotated[float, Field(gt=1.0, le=1e6)] | None = None
    coefficients: Literal["shared", "per-axis"] | None = None
    tikhonov: Annotated[float, Field(gt=0.0, le=1.0)] = 1e-8

    @field_validator("selection")
    @classmethod
    def _selection_exists(cls, name: str) -> str:
        if name not in SELECTIONS:
            raise ValueError(f"unknown{choices(name, sorted(SELECTIONS))}")
        return name

    @model_validator(mode="after")
    def _combination_exists(self) -> Self:
        rows, square = f"rows = '{self.rows}'", self.solve == "square"
        solved, basis = f"solve = '{self.solve}'", f"{self.layout}, {self.centring}"
        if self.rows == "joint" and self.selection != "greedy":
            raise ValueError(f"{rows} with selection = '{self.selection}': only 'greedy'")
        joint = self.rows == "joint" and not self.per_axis  # three equations for each unknown
        if square and (self.rows == "element" or self.repeat_rows or joint):
            fault = "repeat_rows" if self.repeat_rows else rows
            fault += ", coefficients = 'shared'" if joint else ""
            raise ValueError(f"{fault} with {solved}: allowed are qr, tikhonov")
        if self.oversampling > 1 and (square or self.rows == "all"):
            raise ValueError(
                f"oversampling = {self.oversampling} with {rows}, {solved}: only rows = 'scalar', "
                "'joint', 'element' with solve = 'qr', 'tikhonov'"
            )
        if self.gain_bound and (square or self.per_axis or self.rows in ("all", "joint")):
            raise ValueError(
                f"gain_bound = {self.gain_bound} with {rows}, {solved}: only rows = 'scalar' or "
                "'element' with solve = 'qr', 'tikhonov' and coefficients that the axes share"
            )
        if self.separate_axes and self.coefficients == "shared":
            raise ValueError(f"coefficients = 'shared' with {basis}: only 'per-axis'")
        if self.per_axis and self.rows == "scalar":
            raise ValueError(
                f"{rows} with {basis}: coefficients per axis need rows = 'all', 'joint', 'element'"
            )
        return self

    @property
    def modules(self) -> list[str]:
        """Import paths "module:attribute" of the selection rules on whose code samples depend."""
        selects = self.rows in ("scalar", "element") or self.oversampling > 1
        return [SELECTIONS[self.selection]] if selects else []

    @property
    def per_axis(self) -> bool:
        """Whether x, y and z of the projections have separate coefficients of the modes."""
        if self.coefficients is not None:
            return self.coefficients == "per-axis"
        return self.rows == "joint" or self.separate_axes


def load_methods(path: Path) -> dict[str, MethodSpec]:
    """Map names to the methods in ``path`` (methods.yaml); ConfigurationError for any fault."""
    content = read_yaml(path)
    if not isinstance(content, dict) or not content:
        raise ConfigurationError(f"{path}: a mapping of method names is required")
    for name in content:
        if not isinstance(name, str) or not re.fullmatch(METHOD_NAME, name):
            raise ConfigurationError(
                f"{path}: method {shown(name, 60)}: allowed are small letters, digits and hyphens"
            )
    return {
        str(name): validate(MethodSpec, spec, f"{path}: method '{name}'")
        for name, spec in content.items()
    }
