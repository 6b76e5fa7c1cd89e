"""JSON schemas of scene and study files, by which editors complete keys and mark faults."""

import json
from pathlib import Path
from typing import Any

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
