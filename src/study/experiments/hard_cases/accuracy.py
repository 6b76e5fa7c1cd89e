"""Relative errors of the compiled projections against high precision, by class of matrix."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from mpmath import mp

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from study.experiments.hard_cases.case import build
from study.experiments.hard_cases.matrices import CLASSES, VECTORS, MatrixClass
from study.experiments.hard_cases.reference import (
    clamped,
    digits_for,
    exact,
    half_sphere,
    sized,
    spring,
)
from study.experiments.hard_cases.shapes import one_tetrahedron, one_triangle, sheet

SEED = 11


def groups_on(manifold: str) -> list[str]:
    """Registered groups that project on ``manifold``, see `ConstraintGroup`."""
    classes = {name: EFFECTS.load(name) for name in EFFECTS}
    return [name for name, c in classes.items() if getattr(c, "manifold", None) == manifold]


def unit_group(effect: str) -> ConstraintGroup:
    """Group ``effect`` of one element with unit vectors as rest edges: S q holds q itself."""
    volume = EFFECTS.load(effect).rows_per_element == 3
    mesh = one_tetrahedron() if volume else one_triangle()
    return build(mesh, {"effect": effect, "weight": 1.0}, frames=1).groups[0]


def projected(group: ConstraintGroup, d: np.ndarray) -> np.ndarray:
    """Compiled projection of S q = ``d`` (rows, 3) by a group of `unit_group`."""
    y = np.zeros((group.S.shape[1], 3))
    y[1 : 1 + len(d)] = d
    return group.project_elements(y, np.array([0]))


REFERENCES = {"clamped": clamped, "size": sized}


def matrix_error(group: ConstraintGroup, d: np.ndarray, unique: bool) -> tuple[float, float]:
    """Relative error of ``group``'s p(d) at ``d`` (p, 3), and the condition number there.

    Where p is not unique any nearest point is right: the error is that of the distance |d - p|, or
    of the singular values of p (their product, where that is what is kept), whichever is larger,
    and the condition number is 1.
    """
    low, high = group.kernel_parameters()
    found = projected(group, d)
    if not np.isfinite(found).all():
        return np.inf, 1.0
    with mp.workdps(digits_for(d, found)):
        p, condition = REFERENCES[group.manifold or ""](d, low, high)
        if unique and condition < mp.inf:
            return float(mp.norm(exact(found) - p) / mp.norm(p)), float(condition)
        size = max(mp.norm(exact(d)), mp.norm(p))
        distance, best = mp.norm(exact(d) - exact(found)), mp.norm(exact(d) - p)
        outside = _outside(found, low, high, group.manifold == "size")
        return max(float(abs(distance - best) / size), outside), 1.0


def _outside(p: np.ndarray, low: float, high: float, size: bool) -> float:
    """Distance of singular values of p, or of their product, from [low, high].

    A wrong orientation counts fully. The product of what is long and thin is known only as exactly
    as its smallest value.
    """
    sigma = np.linalg.svd(p, compute_uv=False)
    if len(p) == 3 and np.linalg.det(p) < 0.0:
        return 1.0
    measured = np.array([sigma.prod()]) if size else sigma
    stretch = sigma[0] / sigma[-1] if size else 1.0
    return float(np.max(np.maximum(low - measured, measured - high), initial=0.0)) / stretch


def spring_error(group: ConstraintGroup, d: np.ndarray) -> tuple[float, float]:
    """Relative error of the edge d (1, 3) projected by ``group``; the condition number is 1."""
    with mp.workdps(digits_for(d, group.rest[0])):
        p = spring(d, group.rest[0])
        return float(mp.norm(exact(projected(group, d)) - p) / mp.norm(p)), 1.0


def _bending_states() -> dict[str, Any]:
    """States of a curved sheet, by class."""
    return {
        "random": lambda x, rng: rng.standard_normal(x.shape),
        "nearly at rest (1e-6)": lambda x, rng: x + 1e-6 * rng.standard_normal(x.shape),
        "mirrored": lambda x, rng: x * [1.0, -1.0, 1.0] + 1e-3 * rng.standard_normal(x.shape),
        "nearly flat (1e-6)": lambda x, rng: x * [1.0, 1e-6, 1.0],
        "far away (1e6)": lambda x, rng: x + 1e6,
        "huge (1e150)": lambda x, rng: 1e150 * rng.standard_normal(x.shape),
        "tiny (1e-150)": lambda x, rng: 1e-150 * rng.standard_normal(x.shape),
    }


def bending_errors(cases: int, effect: str = "bending") -> Iterator[tuple[str, float, float]]:
    """(class, relative error, condition number) of ``cases`` projected curvature vectors.

    ``effect`` is the group that projects.
    """
    scene = build(sheet(wave=0.1), {"effect": effect, "weight": 1.0}, frames=1)
    group, points = scene.groups[0], scene.mesh.points
    for name, state in _bending_states().items():
        rng = np.random.default_rng(SEED)
        y = state(points, rng)
        # the projection gets the normals as data: those of the rest shape in every state
        group.begin_frame(points)
        for element in rng.permutation(group.elements)[:cases]:
            row = group.S[[element]].toarray()[0]
            used = np.flatnonzero(row)
            found = group.project_elements(y, np.array([element]))
            pole = group.side[element] * group.normals[element]
            with mp.workdps(digits_for(row[used], y[used])):
                p, condition = half_sphere(
                    row[used], y[used], group.magnitude[element], normal=pole
                )
                yield name, float(mp.norm(exact(found) - p) / mp.norm(p)), float(condition)


def _samples(kind: MatrixClass, rows: int, cases: int) -> Iterator[np.ndarray]:
    rng = np.random.default_rng(SEED)
    for _ in range(cases):
        yield kind.make(rng, rows)


def _errors(cases: int) -> Iterator[tuple[str, str, float, float]]:
    """(group, class, relative error, condition number) of every case."""
    for effect in groups_on("length"):
        group = unit_group(effect)
        for kind in VECTORS:
            for d in _samples(kind, 1, cases):
                yield effect, kind.name, *spring_error(group, d)
    for effect in groups_on("half sphere"):
        for name, error, condition in bending_errors(cases, effect):
            yield effect, name, error, condition
    for effect in (name for manifold in REFERENCES for name in groups_on(manifold)):
        group = unit_group(effect)
        for kind in CLASSES:
            if group.rows_per_element in kind.rows:
                for d in _samples(kind, group.rows_per_element, cases):
                    yield effect, kind.name, *matrix_error(group, d, kind.unique)


def kernel_accuracy(cases: int) -> list[dict[str, Any]]:
    """Rows of the table kernel_accuracy, at most ``cases`` matrices a class.

    worst_over_condition is the worst error over max(1, condition number): a backward stable kernel
    keeps it at a few units of round-off, whatever the matrix.
    """
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for group, name, error, condition in _errors(cases):
        row = rows.setdefault(
            (group, name),
            {"group": group, "matrix_class": name, "cases": 0, "condition": 1.0,
             "worst_relative_error": 0.0, "worst_over_condition": 0.0},
        )  # fmt: skip
        row["cases"] += 1
        row["condition"] = max(row["condition"], condition)
        row["worst_relative_error"] = max(row["worst_relative_error"], error)
        scaled = error / max(1.0, condition)
        row["worst_over_condition"] = max(row["worst_over_condition"], scaled)
    return list(rows.values())
