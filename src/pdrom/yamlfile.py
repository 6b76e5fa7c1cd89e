"""Reading YAML and checking it against a typed model, with messages a user can act on."""

from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ValidationError

from pdrom.errors import ConfigurationError

MAX_BYTES = 1_000_000
M = TypeVar("M", bound=BaseModel)


class _UniqueKeyLoader(yaml.SafeLoader):
    """Safe loader (no tag runs code) that refuses a key given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, (dict, list)):
                raise yaml.constructor.ConstructorError(None, None, "a key must be a plain value")
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key '{key}' is given twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> Any:
    """Content of a YAML file; ConfigurationError if it is missing or not plain YAML."""
    if not path.is_file():
        raise ConfigurationError(f"{path}: no such configuration file")
    if path.stat().st_size > MAX_BYTES:
        raise ConfigurationError(f"{path}: larger than {MAX_BYTES} bytes")
    try:
        return yaml.load(path.read_text(encoding="utf-8"), Loader=_UniqueKeyLoader)
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        message = " ".join(str(error).split())
        raise ConfigurationError(f"{path}: not valid YAML: {message}") from error


def validate(model: type[M], data: Any, source: str) -> M:
    """``data`` as an instance of ``model``; ConfigurationError naming file, key and value."""
    if not isinstance(data, dict):
        raise ConfigurationError(f"{source}: a mapping of keys is required, found {data!r:.60}")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise ConfigurationError(f"{source}: {describe(error, model)}") from error


def describe(error: ValidationError, model: type[BaseModel]) -> str:
    """The first fault of a validation as ``key = value: what is allowed``."""
    fault = error.errors()[0]
    location = fault["loc"]
    key = ".".join(str(part) for part in location) or model.__name__
    message = fault["msg"].removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        owner = _model_at(model, location[:-1])
        allowed = f" (allowed: {', '.join(keys_of(owner))})" if owner else ""
        return f"unknown key '{key}'{allowed}"
    if fault["type"] == "missing":
        return f"key '{key}' is missing"
    return f"{key} = {fault['input']!r:.80}: {message}"


def keys_of(model: type[BaseModel]) -> list[str]:
    """Names of the keys that ``model`` accepts."""
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_at(model: type[BaseModel], location: tuple[int | str, ...]) -> type[BaseModel] | None:
    """Model found by following ``location`` from ``model``; None where it is not one model."""
    current: type[BaseModel] | None = model
    for part in location:
        if isinstance(part, int) or current is None:
            continue
        field = current.model_fields.get(part)
        current = _inner_model(field.annotation) if field else current
    return current


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    models = [m for a in get_args(annotation) if (m := _inner_model(a)) is not None]
    return models[0] if len(models) == 1 else None
