"""Defaults of a study's keys."""

from collections.abc import Iterator
from typing import Any

import pytest

from pdrom.core.yamlfile import read_yaml
from places import CONFIG
from study.pipeline.study import StudySettings

# scenes and methods have no default
GIVEN = {"scenes", "methods"}


def defaults() -> dict[str, Any]:
    study = StudySettings(scenes=["spring_oop"], methods=["pod"])
    return study.model_dump(mode="json", by_alias=True, exclude=GIVEN)


def given(content: dict[str, Any], known: Any) -> Iterator[tuple[str, Any, Any]]:
    """(key, value, default) of every value that a configuration gives, inside sections too."""
    for key, value in content.items():
        default = known.get(key) if isinstance(known, dict) else None
        if isinstance(value, dict) and isinstance(default, dict) and default:
            for inner, *rest in given(value, default):
                yield f"{key}.{inner}", *rest
        else:
            yield key, value, default


def test_the_study_repeats_no_default() -> None:
    content = read_yaml(CONFIG / "default.yaml")
    repeated = [key for key, value, default in given(content, defaults()) if value == default]
    assert repeated == []


@pytest.mark.parametrize(("key", "value"), [("sweep", 10), ("timing", 10), ("stability", 120)])
def test_what_the_study_was_made_with(key: str, value: int) -> None:
    """Values that the code once had differently from the file."""
    assert value in defaults()[key].values()
