"""Names that are loaded on demand."""

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.registry import Registry

ENTRIES = {"loads": "json:loads", "absent": "no.such.module:x"}
REGISTRY = Registry("thing", ENTRIES)


@pytest.mark.parametrize("ask", [REGISTRY.load, REGISTRY.__getitem__])
def test_unknown_names_list_what_is_allowed(ask):
    with pytest.raises(
        ConfigurationError, match=r"unknown thing 'other' \(allowed: absent, loads\)"
    ):
        ask("other")
