"""Basis sizes of the reruns."""

import pytest

from study.experiments.kit.settings import resolve_ranks


@pytest.mark.parametrize(
    ("asked", "rank", "sizes"),
    [
        ([6, 10, 20, "full"], 69, [6, 10, 20, 69]),
        (["full", 10, 6], 8, [6, 8, 10]),
        ([6, "full"], 6, [6]),
        ([6, 6], 9, [6]),
        ([6, "full"], 0, [6]),
        (["full"], 0, []),
        ([6, 10], 3, [6, 10]),
    ],
)
def test_sizes_ascend_and_full_is_the_rank(asked, rank, sizes):
    assert resolve_ranks(asked, rank) == sizes
