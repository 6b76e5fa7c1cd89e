"""Reading of YAML files and their validation by typed models, with clear error messages."""

import os
import re
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from pdrom.core.errors import ConfigurationError, choices

MAX_BYTES = 1_000_000
MAX_DEPTH = 100
UNKNOWN = "unknown_key"  # type of the fault of a key that a model does not have
M = TypeVar("M", bound=BaseModel)


class ConfigModel(BaseModel):
    """Base of typed configuration: unknown keys are refused, instances are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _as_written(cls, data: Any) -> Any:
        """Refuse unknown keys, and truth values (yes, on) or texts such as 1_0 for numbers."""
        fields = {field.alias or name: field for name, field in cls.model_fields.items()}
        for key, value in data.items() if isinstance(data, dict) else ():
            if key not in fields and isinstance(key, str):
                more = {"key": key, "choices": choices(key, fields)}
                raise PydanticCustomError(UNKNOWN, "unknown key {key}{choices}", more)
            kind = fields[key].annotation if key in fields else bool
            for entry in value if isinstance(value, (list, tuple)) else [value]:
                if isinstance(entry, bool) and kind is not bool:
                    fault = "a truth value (yes, on, true ...)"
                    raise ValueError(f"{key} = {shown(value, 60)}: {fault}")
                if isinstance(entry, str) and _misread(entry) and "str" not in str(kind):
                    raise ValueError(f"{key} = {shown(value, 60)}: write {PLAIN}")
        return data


PLAIN = "a decimal number without underscores, colons, leading zeros or letters of a base"
_PLAIN = re.compile(r"[-+]?(0|[1-9]\d*|\d*\.\d+|\d+\.)(e[-+]?\d+)?", re.IGNORECASE)
_NUMBER = re.compile(
    r"[-+]?(0[bx][\da-f_]+|(?=\.?\d)[\d_]*(:[0-5]?\d)*(\.[\d_]*)?(e[-+]?[\d_]+)?)", re.IGNORECASE
)
_TRUTH = "tag:yaml.org,2002:bool", re.compile("(true|True|TRUE|false|False|FALSE)$")
_DATE = "tag:yaml.org,2002:timestamp"


def _misread(text: str) -> bool:
    """Tell whether YAML 1.1 or Python reads ``text`` as another number than the decimal shown."""
    return bool(_NUMBER.fullmatch(text)) and not _PLAIN.fullmatch(text)


class _PlainLoader(yaml.CSafeLoader):
    """YAML loader that runs no code named by tags and refuses a key that is given twice.

    The words yes, no, on and off and dates are texts.
    """

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, (dict, list, set)):
                raise yaml.constructor.ConstructorError(None, None, "a key must be a plain value")
            if key in seen:
                fault = f"key '{key}' is given twice"
                raise yaml.constructor.ConstructorError(None, None, fault, key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


_PlainLoader.yaml_implicit_resolvers = {
    first: [_TRUTH if each[0] == _TRUTH[0] else each for each in kinds if each[0] != _DATE]
    for first, kinds in yaml.CSafeLoader.yaml_implicit_resolvers.items()
}


def require_as_written(text: str, source: str, place: str = "") -> None:
    """Raise ConfigurationError if a number in the YAML ``text`` would be read as another one.

    The message begins with ``source`` and names the key, which is below ``place`` if given.
    """
    for key, node in _scalars(yaml.compose(text, Loader=_PlainLoader), place):
        if _misread(node.value) and (not node.style or not node.tag.endswith(":str")):
            read = f"YAML reads it as {shown(yaml.safe_load(node.value), 60)}"
            fault = f"{source}: {key} = {node.value}: {read}; write {PLAIN}, or a text in quotes"
            raise ConfigurationError(fault)


def _scalars(node: Any, place: str) -> Iterator[tuple[str, yaml.ScalarNode]]:
    if isinstance(node, yaml.ScalarNode):
        yield place, node
    for number, entry in enumerate(node.value if isinstance(node, yaml.CollectionNode) else ()):
        key, value = entry if isinstance(entry, tuple) else (None, entry)
        name = number if key is None else key.value
        yield from _scalars(key, place)
        yield from _scalars(value, f"{place}.{name}" if place else str(name))


def _require_plain(text: str) -> None:
    """Refuse YAML with deep nesting or aliases: a few aliases can expand to billions of entries."""
    depth, fault = 0, ""
    events: Iterator[Any] = yaml.parse(text, Loader=yaml.CSafeLoader)
    for event in events:
        if isinstance(event, yaml.AliasEvent):
            fault = f"alias '*{event.anchor}' is not allowed"
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            fault = f"nested more than {MAX_DEPTH} levels deep"
        if fault:
            raise yaml.composer.ComposerError(None, None, fault, event.start_mark)


def read_yaml(path: Path) -> Any:
    """Read the YAML file ``path``; ConfigurationError if unreadable, invalid or with aliases."""
    try:
        if not path.is_file():
            whole = Path(f"{path}.yaml")
            meant = f", did you mean '{whole}'?" if whole.is_file() else ""
            what = "a folder, name a file in it" if path.is_dir() else "no such configuration file"
            raise ConfigurationError(f"{path}: {what}{meant}")
        if path.stat().st_size > MAX_BYTES:
            raise ConfigurationError(f"{path}: larger than {MAX_BYTES} bytes")
        # utf-8-sig skips a byte order mark, which some editors write
        text = path.read_text(encoding="utf-8-sig")
        _require_plain(text)
        require_as_written(text, str(path))
        return yaml.load(text, Loader=_PlainLoader)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        # ValueError: invalid UTF-8 or a number too long; TypeError: an unhashable key
        message = " ".join(str(error).replace('in "<unicode string>", ', "in ").split())
        raise ConfigurationError(f"{path}: not valid YAML: {message}") from error
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read ({error.strerror})") from error


def validate(model: type[M], data: Any, source: str) -> M:
    """Validate ``data`` of the file ``source`` as a ``model``; ConfigurationError for a fault."""
    if not isinstance(data, dict):
        found = "nothing" if data is None else shown(data, 60)
        raise ConfigurationError(f"{source}: a mapping of keys is required, found {found}")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise ConfigurationError(f"{source}: {describe(error, model)}") from error


def describe(error: ValidationError, model: type[BaseModel]) -> str:
    """Describe the first fault that ``model`` found, as ``key = value: what is required``."""
    # a misspelt required key causes two faults, unknown and missing: "missing" helps less, so last
    fault = min(error.errors(), key=lambda fault: fault["type"] == "missing")
    location = fault["loc"]
    names = [str(part) for part in location if part != "constrained-int"]
    key = " ".join(".".join(names).split()) or model.__name__
    message = fault["msg"].removeprefix("Value error, ")
    # users write a list in YAML where Python has a tuple
    message = message.replace("valid tuple", "valid list").replace("Tuple should", "List should")
    if fault["type"] == UNKNOWN:
        place = ".".join([*names, fault["ctx"]["key"]])
        return f"unknown key '{place}'{fault['ctx']['choices']}"
    if fault["type"] == "invalid_key":
        return f"{key}: the key is not a text"
    if fault["type"] == "missing":
        return f"key '{key}' is missing"
    if fault["type"] == "union_tag_not_found":
        return f"{key}: key {fault['ctx']['discriminator']} is missing"
    if fault["type"] == "value_error" and isinstance(fault["input"], (dict, list, BaseModel)):
        # the value, which may be long, is left out: the message says which part of it is wrong
        return f"{key}: {message}" if location and not message.startswith(key) else message
    return f"{key} = {shown(fault['input'], 80)}: {message}"


def shown(value: Any, width: int) -> str:
    """Format ``value`` for a message, on one line and cut to ``width`` characters."""
    try:
        return f"{value!r:.{width}}".replace("\n", " ")
    except Exception:  # Python does not print integers of more than 4300 digits
        return f"a {type(value).__name__}"


def keys_of(model: type[BaseModel]) -> list[str]:
    """Return the names of the keys that ``model`` accepts."""
    return [field.alias or name for name, field in model.model_fields.items()]


# Longest file name and longest path that operating systems accept, in bytes.
MAX_NAME, MAX_PATH = 255, 4095


def _scene_name(name: str) -> str:
    if not re.fullmatch("[a-z][a-z0-9_]{0,63}", name):
        raise ValueError(
            "a scene's name begins with a small letter and goes on with small letters, digits and "
            "underscores, 64 characters at most"
        )
    return name


def check_lengths(path: str) -> None:
    """Raise ValueError if ``path`` exceeds `MAX_PATH` bytes or a name in it `MAX_NAME` bytes."""
    for name, most in ((path, MAX_PATH), *((part, MAX_NAME) for part in PurePath(path).parts)):
        if len(os.fsencode(name)) > most:
            raise ValueError(f"a name of at most {most} bytes is required")


def named(keys: Any, stem: str) -> Any:
    """Add a missing name and title, made from the file name ``stem``, to a scene's ``keys``."""
    if not isinstance(keys, dict):
        return keys
    valid = re.sub(r"[^a-z0-9_]+", "_", stem.lower()).lstrip("_0123456789")[:64] or "scene"
    name = keys.get("name", valid)
    title = name if isinstance(name, str) else valid
    return {"name": name, "title": title.replace("_", " ").capitalize(), **keys}


SceneName = Annotated[str, AfterValidator(_scene_name)]
