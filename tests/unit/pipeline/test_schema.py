"""Schemas and defaults of scene and study files."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import pytest
import yaml
from jsonschema import Draft202012Validator

from pdrom.command.main import run
from pdrom.command.new import template
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.model.effects import EFFECTS
from pdrom.pipeline.schema import defaults, scene_schema, study_schema
from pdrom.pipeline.study import StudySettings
from places import CONFIG, ROOT

LINE = re.compile(r"# yaml-language-server: \$schema=(\S+)")
SCENES = sorted((CONFIG / "scenes").glob("*.yaml"))
STUDIES = [path for path in sorted(CONFIG.glob("*.yaml")) if LINE.match(path.read_text("utf-8"))]


def named(path: Path) -> Path:
    """The schema that the first line of a file names."""
    found = LINE.fullmatch(path.read_text("utf-8").splitlines()[0])
    assert found, path
    address = urlparse(found[1])
    return Path(unquote(address.path)) if address.scheme else path.parent / found[1]


def faults(path: Path) -> list[str]:
    schema = json.loads(named(path).read_text("utf-8"))
    return [error.message for error in Draft202012Validator(schema).iter_errors(read_yaml(path))]


@pytest.mark.parametrize("path", [*SCENES, *STUDIES], ids=lambda path: path.stem)
def test_a_file_of_the_project_has_no_fault(path):
    assert named(path).resolve().parent == CONFIG / "schema"
    assert faults(path) == []


def test_every_configuration_of_a_study_names_its_schema():
    keys = set(study_schema()["properties"])
    others = [path for path in CONFIG.glob("*.yaml") if path not in STUDIES]
    assert {"default", "tiny"} <= {path.stem for path in STUDIES}
    assert [path.stem for path in others if set(read_yaml(path)) <= keys] == []


def test_an_effect_has_its_own_keys():
    scene, check = yaml.safe_load(template("sheet")), Draft202012Validator(scene_schema())
    assert list(check.iter_errors(scene)) == []
    for fault in ({"wieght": 1.0}, {"weight": "heavy"}, {"effect": "sprung"}):
        effects = [{"effect": "spring", "weight": 1.0} | fault]
        assert list(check.iter_errors(scene | {"effects": effects})) != []


def test_definitions_of_the_same_name_are_the_same():
    made = scene_schema()["$defs"]
    for name in EFFECTS:
        for key, held in EFFECTS.load(name).Config.model_json_schema().get("$defs", {}).items():
            assert made[key] == held


def test_a_new_scene_names_the_schema_wherever_it_lies(tmp_path, monkeypatch):
    folder = tmp_path / "Étude du projet"
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert run(["new", "sheet"]) == 0
    assert named(folder / "sheet.yaml") == ROOT / "config" / "schema" / "scene.json"
    assert faults(folder / "sheet.yaml") == []


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


def test_defaults_are_a_valid_configuration() -> None:
    study = {"scenes": ["spring_oop"], "methods": ["pod"]}
    assert validate(StudySettings, defaults() | study, "defaults") == validate(
        StudySettings, study, "nothing"
    )


@pytest.mark.parametrize(("key", "value"), [("sweep", 10), ("timing", 10), ("stability", 120)])
def test_what_the_study_was_made_with(key: str, value: int) -> None:
    """Values that the code once had differently from the file."""
    assert value in defaults()[key].values()
