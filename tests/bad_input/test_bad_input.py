"""Every broken input gives one line that names file, key, value and the allowed values."""

from pathlib import Path

import pytest

from bad_input.cases import CASES, Case
from bad_input.project import load_project, make_project
from pdrom.core.errors import PdromError


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_broken_input_is_named_in_one_line(case: Case, tmp_path: Path) -> None:
    root = make_project(tmp_path, case.changes)
    with pytest.raises(PdromError) as caught:
        load_project(root, case.overrides)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.replace(str(root), "")) < 700
    missing = [p for p in case.parts if not any(q in message for q in p.split("|"))]
    assert missing == [], message
