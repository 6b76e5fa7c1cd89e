"""What ``pdrom show WORD`` says about the words of a scene's file, from config/words.yaml."""

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import named, read_yaml
from pdrom.model.constraints.base import WeightFactor
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.keyframes import Key
from pdrom.model.held_out import HeldOut
from pdrom.model.mesh import selection
from pdrom.model.mesh.config import BarMesh, ClothMesh, MeshFile
from pdrom.model.scene import MassConfig, ReductionPlan, SceneConfig


def models() -> Iterator[tuple[str, str, type[BaseModel]]]:
    """Yield each word that has keys, the form in which it stands in a file, and its model."""
    yield "scene", "SCENE.yaml", SceneConfig
    yield from ((name, f"{{effect: {name}, ...}}", EFFECTS.load(name).Config) for name in EFFECTS)
    for shape in selection.Shape.__subclasses__():
        kind = shape.model_fields["kind"].default
        yield kind, f"select: {{kind: {kind}, ...}}", shape
    for kind, mesh in (("cloth", ClothMesh), ("bar", BarMesh), ("file", MeshFile)):
        yield kind, f"mesh: {{kind: {kind}, ...}}", mesh
    yield "masses", "masses: [{...}]", MassConfig
    yield "reduce", "reduce: {GROUP: {...}}", ReductionPlan
    yield "held_out", "held_out: {...}", HeldOut
    yield "factors", "factors: [{...}]", WeightFactor
    yield "keys", "keys: [{...}]", Key


def explained(word: str) -> list[str]:
    """Return lines about a ``word``: all that has this name with its keys, and keys of this name.

    Raises ConfigurationError, which lists all words, for a word that no scene can have.
    """
    texts, lines = read_yaml(config_file("words.yaml")), dict[str, list[str]]()
    for name, form, model in models():
        lines[f"{form}: {texts['words'][name]}"] = [
            name,
            *({"effect", "kind"} & {*model.model_fields}),
        ]
        for key, field in model.model_fields.items():
            if key in ("effect", "kind"):
                continue
            unit, sentence = texts["keys"].get(f"{name}.{key}") or texts["keys"][key]
            default = "required" if field.is_required() else _plain(field.default)
            default = "" if key in named({}, "") and model is SceneConfig else default
            options = list(dict.fromkeys(_options(field.annotation)))
            parts = filter(None, [unit, default, " or ".join(options), sentence])
            sides = (*selection.SIDES, *selection.WORDS) if key == "select" else ()
            lines[f"  {name}.{key}: {'; '.join(parts)}"] = [name, key, *options, *sides]
    found = [line for line, words in lines.items() if word in words]
    if not found:
        known = choices(word, dict.fromkeys(each for words in lines.values() for each in words))
        raise ConfigurationError(f"'{word}': no such file, and no word of a scene{known}")
    return found


def _options(annotation: Any) -> list[str]:
    """Return the words that the ``annotation`` of a key allows."""
    parts = get_args(annotation)
    if get_origin(annotation) is Literal:
        return list(parts)
    return [option for part in parts for option in _options(part)]


def _plain(default: Any) -> str:
    own = "its keys' defaults" if isinstance(default, BaseModel) else default
    own = "none" if own in (None, (), PydanticUndefined) else own
    return f"default {list(own) if isinstance(own, tuple) else own}"
