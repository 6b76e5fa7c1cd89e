"""Entry and element indices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import SamplingError
from pdrom.reduction.sampling import Sampling


def test_entries_belong_to_elements_in_order_of_need():
    """Two rows an element: six entries each."""
    sampling = Sampling.of_entries(np.array([13, 0, 17, 30, 5]), 2, 6)
    assert sampling.entries.tolist() == [13, 0, 17, 30, 5]
    assert sampling.elements.tolist() == [2, 0, 5]


def test_whole_elements_have_all_their_entries():
    sampling = Sampling.of_elements(np.array([3, 1]), 1, 4)
    assert sampling.entries.tolist() == [9, 10, 11, 3, 4, 5]
    assert sampling.elements.tolist() == [3, 1]


@given(st.integers(1, 3), st.lists(st.integers(0, 19), min_size=1, unique=True))
def test_element_entries_lead_back_to_their_elements(rows, elements):
    sampling = Sampling.of_elements(np.array(elements), rows, 20)
    assert sampling.elements.tolist() == elements
    assert len(sampling.entries) == 3 * rows * len(elements)
    assert (np.unique(sampling.entries // (3 * rows)) == sorted(elements)).all()


@pytest.mark.parametrize("entries", [[], [-1], [36], [0, 36]])
def test_entries_out_of_range_are_named(entries):
    with pytest.raises(SamplingError, match="allowed are 0 to 35"):
        Sampling.of_entries(np.array(entries, dtype=int), 2, 6)


def test_repeats_need_permission():
    with pytest.raises(SamplingError, match="repeated"):
        Sampling.of_entries(np.array([3, 3]), 1, 4)
    assert Sampling.of_entries(np.array([3, 3]), 1, 4, repeats=True).entries.tolist() == [3, 3]
    with pytest.raises(SamplingError, match="repeated"):
        Sampling.of_elements(np.array([2, 2]), 1, 4)
