"""JSON schemas of scene and study files, by which editors complete keys and mark faults; defaults.

``.venv/bin/python -m pdrom.pipeline.schema`` lists what a configuration may leave out, as YAML.
"""

import json
import sys
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from pdrom.model.effects import EFFECTS
from pdrom.model.scene import SceneConfig
from pdrom.pipeline.study import StudySettings

FOLDER = Path("config/schema")
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """Schema of a scene: an entry of ``effects`` has the keys of the effect that it names."""
    schema = SceneConfig.model_json_schema()
    definitions = schema["$defs"]
    del definitions["EffectConfig"]
    choices = []
    for name in sorted(EFFECTS):
        own = EFFECTS.load(name).Config.model_json_schema()
        definitions |= own.pop("$defs", {})
        own["properties"]["effect"] = {"const": name}
        own["required"] = sorted({"effect", *own.get("required", ())})
        definitions[f"effect {name}"] = own
        choices.append({"$ref": f"#/$defs/effect {name}".replace(" ", "%20")})
    schema["properties"]["effects"]["items"] = {"oneOf": choices}
    return {"$schema": DIALECT, **schema}


def study_schema() -> dict[str, Any]:
    """Schema of a study: a file may leave out every key, as others are merged with it."""
    schema = StudySettings.model_json_schema()
    del schema["required"]
    return {"$schema": DIALECT, **schema}


def schemas() -> dict[Path, str]:
    """Content of each schema by its place in the project."""
    made = {"scene.json": scene_schema(), "study.json": study_schema()}
    return {FOLDER / name: json.dumps(schema, indent=1) + "\n" for name, schema in made.items()}


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
    listed = yaml.safe_dump(defaults(), sort_keys=False, default_flow_style=None, width=100)
    sys.stdout.write(listed)
