"""Errors of the published code's method, against this study's own and against its choices."""

import numpy as np
import pytest

from pdrom.model.metrics import relative_errors
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import load_methods
from pdrom.reduction.sampling import Reduction, select
from places import ROOT
from study.experiments.published_choices.choices import (
    ALONE,
    CUMULATIVE,
    SIGNS,
    TIES,
    Variant,
    variants,
)
from study.experiments.published_choices.reconstruction import (
    decompose,
    errors,
    idle_axes,
    training_snapshots,
)

SIZES = [1, 3, 6]


@pytest.fixture
def snapshots(rng):
    """Eight snapshots of twelve elements with two rows each."""
    return rng.standard_normal((8, 24, 3)) + rng.standard_normal((24, 3))


def variant(*taken, **seeds) -> Variant:
    return Variant(CUMULATIVE, "", frozenset(taken), **seeds)


def found(snapshots, chosen, row_sizes=None):
    sizes = np.ones(snapshots.shape[1]) if row_sizes is None else row_sizes
    return errors(decompose(snapshots, sizes, chosen.taken), 2, SIZES, chosen)


def test_without_a_choice_they_are_those_of_the_study(snapshots):
    method = load_methods(ROOT / "config" / "methods.yaml")["published"]
    basis = compute_basis(snapshots, np.ones(24), 1e-14, 2, method)
    ours = found(snapshots, variant())
    for r, row in zip(SIZES, ours, strict=True):
        reduction = Reduction(basis, select(basis, method, r), method, r)
        expected = relative_errors(snapshots, reduction.reconstruct(snapshots), 1e-14)[1:]
        np.testing.assert_allclose(row, expected, rtol=1e-6)


def test_the_rows_of_an_element_are_taken_for_its_number(snapshots):
    """With one row an element there is nothing to confuse."""
    data = decompose(snapshots, np.ones(24), frozenset())
    right, wrong = variant(), variant("rows")
    same = [errors(data, 1, SIZES, chosen) for chosen in (right, wrong)]
    np.testing.assert_array_equal(*same)
    assert np.nanmax(np.abs(errors(data, 2, SIZES, wrong) - same[0])) > 1e-3


def test_where_no_row_is_repeated_the_tikhonov_term_does_not_matter(snapshots):
    plain, regularised = found(snapshots, variant("system")), found(snapshots, variant())
    np.testing.assert_allclose(plain[:2], regularised[:2], rtol=1e-4)


def test_equal_weights_change_nothing(snapshots):
    """Apart from the scale of the modes, which the term of Tikhonov would see."""
    np.testing.assert_allclose(
        found(snapshots, variant("system", "weighting"), np.full(24, 4.0)),
        found(snapshots, variant("system")),
        rtol=1e-6,
    )


def test_draws_are_deterministic_and_change_something(snapshots):
    first, again, other = (found(snapshots, variant(signs=seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-6


def test_ties_are_drawn_among_equal_rows(snapshots):
    """Every row twice: whichever of the two is picked, its twin gives the same errors."""
    twins = np.repeat(snapshots, 2, axis=1)
    data = decompose(twins, np.ones(48), frozenset())
    plain = errors(data, 1, SIZES, variant("system"))
    drawn = errors(data, 1, SIZES, variant("system", ties=1))
    np.testing.assert_allclose(drawn, plain, rtol=1e-6)


def test_an_axis_at_rest_has_no_error_but_may_select(snapshots):
    snapshots[:, :, 2] = 0.0
    assert idle_axes(snapshots).tolist() == [False, False, True]
    without, within = found(snapshots, variant()), found(snapshots, variant("idle"))
    for errors_ in (without, within):
        assert np.isnan(errors_[:, 2]).all()
        assert np.isfinite(errors_[:, :2]).all()
    assert np.abs(without - within)[:, :2].max() > 1e-6


def test_frames_are_spread_or_the_first_ones():
    frames = np.arange(21)[:, None, None] * np.ones((1, 1, 3))
    assert training_snapshots(frames, 4, frozenset())[:, 0, 0].tolist() == [0, 6, 14, 20]
    assert training_snapshots(frames, 4, {"frames"})[:, 0, 0].tolist() == [0, 2, 4, 6]


def test_variants_lead_from_the_study_to_the_published_code():
    applicable = ("floor", "signs", "rows")
    every = list(variants(applicable, 2))
    steps = [v for v in every if v.direction == CUMULATIVE]
    assert [len(v.taken) for v in steps] == [0, 1, 2, 3]
    assert [v.taken for v in every if v.direction == ALONE] == [{c} for c in applicable]
    for direction in (SIGNS, TIES):
        drawn = [v for v in every if v.direction == direction]
        assert [v.taken for v in drawn] == [set(applicable)] * 2
    assert len({(v.direction, v.title) for v in every}) == len(every)
