"""Defaults of all settings, as YAML: what a configuration may leave out.

``.venv/bin/python -m pdrom.pipeline.defaults`` lists them.
"""

import sys
from typing import Any

import yaml
from pydantic import BaseModel

from pdrom.pipeline.study import StudySettings


def defaults() -> dict[str, Any]:
    """Plain default of every key that has one."""
    fields = StudySettings.model_fields
    values = {name: field.default for name, field in fields.items() if not field.is_required()}
    return {name: _plain(value) for name, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", by_alias=True)
    return list(value) if isinstance(value, tuple) else value


if __name__ == "__main__":
    sys.stdout.write(
        yaml.safe_dump(defaults(), sort_keys=False, default_flow_style=None, width=100)
    )
