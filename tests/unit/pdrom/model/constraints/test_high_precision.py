"""Compiled projections of hard matrices agree with their definitions in mpmath.

If the nearest point is not unique, the distance is compared, and p must lie on the manifold.
"""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from mpmath import mp

from builders import bound, projected, random_rotation
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.generators import cloth
from strategies import SEEDS

# A backward stable projection has an error of a few rounding errors times the condition number.
STABLE = 20.0 * np.finfo(float).eps


def groups_on(manifold: str) -> list[str]:
    """Registered groups that project on ``manifold``, see `ConstraintGroup`."""
    return [name for name in EFFECTS if getattr(EFFECTS.load(name), "manifold", None) == manifold]


CLAMPED = groups_on("clamped")
KINDS = {name: EFFECTS.load(name) for name in (*CLAMPED, *groups_on("length"))}


def test_every_registered_group_is_tested():
    assert CLAMPED == ["strain", "tetrahedron_strain", "deformation_gradient"]
    assert groups_on("length") == ["spring"]
    assert groups_on("half sphere") == ["bending"]


def with_singular_values(*values: float):
    def make(rng: np.random.Generator, rows: int) -> np.ndarray:
        left = random_rotation(rng)
        if rows == 2:
            a, b = np.array([[0.0, 1.0], [-1.0, 0.0]]), rng.uniform(0.0, 2.0 * np.pi)
            left = np.cos(b) * np.eye(2) - np.sin(b) * a
        return left @ np.diag(values[:rows]) @ random_rotation(rng)[:rows]

    return make


def one_row_times(size: float):
    def make(rng: np.random.Generator, rows: int) -> np.ndarray:
        d = rng.standard_normal((rows, 3))
        d[rng.integers(rows)] *= size
        return d

    return make


def half_turn(rng: np.random.Generator, rows: int) -> np.ndarray:
    axis = random_rotation(rng)[0]
    frame = random_rotation(rng)
    stretch = frame.T @ np.diag([1.3, 1.0, 0.8]) @ frame
    return ((2.0 * np.outer(axis, axis) - np.eye(3)) @ stretch)[:rows]


def mirror(rng: np.random.Generator, rows: int) -> np.ndarray:
    d = np.eye(3)[rng.permutation(3)]
    d[0] *= -np.linalg.det(d)
    return d[:rows]


MATRICES = {
    "random": lambda rng, rows: rng.standard_normal((rows, 3)),
    "member": with_singular_values(1.0, 1.0, 1.0),
    "in range": with_singular_values(1.005, 1.0, 0.995),
    "nearly singular (1e-8)": with_singular_values(1.0, 0.7, 1e-8),
    "nearly singular (1e-16)": with_singular_values(1.0, 0.7, 1e-16),
    "one row times 1e-100": one_row_times(1e-100),
    "one row times 1e-300": one_row_times(1e-300),
    "nearly rank one (1e-6)": with_singular_values(1.0, 1e-6, 4e-7),
    "repeated": with_singular_values(1.3, 1.3, 1.3),
    "nearly repeated (1e-9)": with_singular_values(1.3, 1.3 + 1e-9, 1.3 - 1e-9),
    "rotation by pi": half_turn,
    "inverted": with_singular_values(1.2, 1.0, -0.6),
    "nearly mirrored (1e-6)": with_singular_values(1.2, 1.0, -1.0 + 1e-6),
    "where a closed form begins (1e-30)": with_singular_values(2e-30, 8e-31, 4e-31),
    "where a closed form ends (1e30)": with_singular_values(1e30, 4e29, 2e29),
    "ill-scaled": lambda rng, rows: rng.standard_normal((rows, 3)) * 10.0 ** rng.uniform(
        -8, 8, (rows, 3)
    ),
    "where determinants overflow (1e103)": lambda rng, rows: 10.0 ** rng.uniform(
        102.6, 103.2
    ) * rng.standard_normal((rows, 3)),
    "huge (1e150)": lambda rng, rows: 1e150 * rng.standard_normal((rows, 3)),
    "tiny (1e-150)": lambda rng, rows: 1e-150 * rng.standard_normal((rows, 3)),
    "mirrored": mirror,
    "rank one": lambda rng, rows: np.outer(
        rng.integers(1, 9, rows), rng.integers(1, 9, 3)
    ).astype(float),
    "zero": lambda rng, rows: np.zeros((rows, 3)),
    "any size": lambda rng, rows: 10.0 ** rng.uniform(-300, 300) * rng.standard_normal((rows, 3)),
}  # fmt: skip
AMBIGUOUS = ("mirrored", "rank one", "zero")
# narrow and wide ranges of singular values
CASES = [(name, {}) for name in CLAMPED] + [
    (name, {"minimum": 0.1, "maximum": 10.0}) for name in CLAMPED if "strain" in name
]


def digits_for(*arrays: np.ndarray) -> int:
    """Digits that leave 50 after squares and differences of the entries of ``arrays``."""
    entries = np.abs(np.concatenate([np.ravel(a) for a in arrays]))
    entries = entries[entries > 0.0]
    spread = np.ptp(np.log10(entries)) if len(entries) else 0.0
    return 50 + 2 * math.ceil(spread)


def exact(a: np.ndarray) -> mpmath.matrix:
    return mpmath.matrix(a.tolist())


def nearest(group: ConstraintGroup, d: np.ndarray) -> tuple[mpmath.matrix, mpmath.mpf]:
    """Nearest point of the manifold to d = F^T, and the condition number (inf: not unique).

    The singular values, of three the last with the sign of det F, are clamped to the group's range.
    """
    low, high = (mpmath.mpf(end) for end in group.kernel_parameters())
    u, sigma, vt = mp.svd_r(exact(d))
    values = list(sigma)
    if len(values) == 3:
        sign = mp.sign(mp.det(u) * mp.det(vt))
        values[2] *= sign
        for i in range(3):
            u[i, 2] *= sign
    found = [min(max(v, low), high) for v in values]
    gap = values[1] + (values[2] if len(values) == 3 else 0)
    condition = values[0] / gap if gap > 0 else mp.inf
    return u * mpmath.diag(found) * vt, condition


def outside(group: ConstraintGroup, p: np.ndarray) -> float:
    """Distance of the singular values of p from the range of the group.

    A wrong orientation counts as a distance, too.
    """
    low, high = group.kernel_parameters()
    sigma = np.linalg.svd(p, compute_uv=False)
    if len(p) == 3 and np.linalg.det(p) < 0.0:
        return 1.0
    return float(np.max(np.maximum(low - sigma, sigma - high), initial=0.0)) / sigma[0]


@settings(max_examples=3)
@given(seed=SEEDS)
@pytest.mark.parametrize(("effect", "ends"), CASES)
def test_projections_of_matrices_are_backward_stable(effect, ends, seed):
    kind, rng = KINDS[effect], np.random.default_rng(seed)
    group = bound(kind, kind.rows_per_element, 1, **ends)
    for name, make in MATRICES.items():
        d = make(rng, group.rows_per_element)
        found = projected(group, d[None])[0]
        assert np.isfinite(found).all(), name
        with mp.workdps(digits_for(d, found)):
            p, condition = nearest(group, d)
            ambiguous = name in AMBIGUOUS and (name != "mirrored" or len(d) == 3)
            unique = condition < mp.inf and not ambiguous
            if unique:
                error = mp.norm(exact(found) - p) / mp.norm(p)
                assert error <= STABLE * max(1.0, condition), name
            else:
                distance, best = mp.norm(exact(d) - exact(found)), mp.norm(exact(d) - p)
                assert abs(distance - best) <= STABLE * max(mp.norm(exact(d)), mp.norm(p)), name
            assert outside(group, found) <= STABLE, name


@pytest.mark.parametrize("size", [1.0, 1e300, 1e-300, 1e-322, 0.0])
def test_projections_of_springs_are_accurate(size, rng):
    group = bound(KINDS["spring"], 1, 1)
    for _ in range(20):
        d = size * rng.standard_normal((1, 3)) * 10.0 ** rng.uniform(-8, 0, (1, 3))
        with mp.workdps(digits_for(d, group.rest[0])):
            rest, length = exact(group.rest[:1]), mp.norm(exact(d))
            p = exact(d) * (mp.norm(rest) / length) if length else rest
            assert mp.norm(exact(projected(group, d[None])[0]) - p) <= STABLE * mp.norm(p)


CURVED = {
    "random": lambda x, rng: rng.standard_normal(x.shape),
    "nearly at rest (1e-6)": lambda x, rng: x + 1e-6 * rng.standard_normal(x.shape),
    "mirrored": lambda x, rng: x * [1.0, -1.0, 1.0] + 1e-3 * rng.standard_normal(x.shape),
    "nearly flat (1e-6)": lambda x, rng: x * [1.0, 1e-6, 1.0],
    "far away (1e6)": lambda x, rng: x + 1e6,
    "huge (1e150)": lambda x, rng: 1e150 * rng.standard_normal(x.shape),
    "tiny (1e-150)": lambda x, rng: 1e-150 * rng.standard_normal(x.shape),
    "any size": lambda x, rng: 10.0 ** rng.uniform(-300, 300) * rng.standard_normal(x.shape),
}


@pytest.mark.parametrize("state", CURVED)
def test_projections_of_bending_are_accurate(state, rng):
    """Condition number: the terms that cancel in H = row y over |H|, for H on the wrong side over
    the distance of its direction from the opposite pole."""
    mesh, kind = cloth(6, 6, "xz", wave=0.1), EFFECTS.load("bending")
    group = kind(kind.Config(weight=1.0), mesh, np.ones(mesh.vertices)).for_run()
    y = CURVED[state](mesh.points, rng)
    group.begin_frame(mesh.points)  # in every state with the normals of the rest shape
    for element in rng.permutation(group.elements)[:16]:
        row, pole = group.S[[element]].toarray(), group.side[element] * group.normals[element]
        used = np.flatnonzero(row)
        with mp.workdps(digits_for(row[:, used], y[used])):
            h, n = exact(row[:, used]) * exact(y[used]), exact(pole[None])
            direction = h / mp.norm(h)
            terms = exact(np.abs(row[:, used])) * exact(np.abs(y[used]))
            condition = mp.norm(terms) / mp.norm(h)
            height = mp.fsum(direction[i] * n[i] for i in range(3))
            if height < 0:
                direction -= height * n
                condition /= mp.norm(direction)
                direction /= mp.norm(direction)
            p = direction * mpmath.mpf(group.magnitude[element])
            found = group.project_elements(y, np.array([element]))
            assert mp.norm(exact(found) - p) <= STABLE * max(1.0, condition) * mp.norm(p)
