"""The first entry that is no number is named."""

import numpy as np
import pytest

from pdrom.core.errors import SceneError
from pdrom.core.store import require_finite


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_number_that_is_none_is_named(bad):
    array = np.zeros((3, 4))
    assert require_finite("x", array, SceneError) is array
    array[1, 2] = array[2, 0] = bad
    with pytest.raises(SceneError, match=rf"x: entry \(1, 2\) is {bad}"):
        require_finite("x", array, SceneError)
