"""``pdrom show FILE``: print the contents of a result, its origin, and whether it is intact.

``pdrom show WORD`` explains a word of scene files.
"""

import argparse
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from pdrom.command.base import Command, Status, flag, text
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, StorageError, suggestion
from pdrom.core.provenance import RECORD
from pdrom.core.yamlfile import named, read_yaml, validate

LONGEST = 100  # characters of an HDF5 attribute's value that are shown at most


def perform(arguments: argparse.Namespace) -> Status:
    """Print the contents of a file or explain a word; no file is changed."""
    from pdrom.core.store.checksum import check_file, provenance_of

    path = Path(arguments.file)
    if re.fullmatch("[a-z_]{1,40}", arguments.file) and not path.exists():
        sys.stdout.write("\n".join(_explained(arguments.file)) + "\n")
        return Status.DONE
    condition, record = check_file(path), provenance_of(path)
    lines = [f"{path}: {path.stat().st_size:,} bytes, {condition.value}"]
    match path.suffix:
        case ".h5" | ".hdf5":
            lines += _hdf5(path, arguments.configuration)
        case ".csv":
            lines += _table(path)
        case ".yaml" | ".yml":
            lines += _effects(_scene(path))
        case ".json":
            lines += (f"  {line}" for line in path.read_text("utf-8").splitlines())
    lines.append("provenance:" if record else "provenance: unknown (no valid checksum)")
    ordered = [name for name in dict.fromkeys((*RECORD, *record)) if name in record]
    lines += [f"  {name}: {record[name]}" for name in ordered]
    sys.stdout.write("\n".join(lines) + "\n")
    return Status.DONE


def _explained(word: str) -> list[str]:
    """Return lines that explain a ``word`` of scene files; ConfigurationError if it is unknown.

    They explain everything of this name with its keys, and the keys of this name or value.
    """
    lines = list[tuple[str, list[str]]]()  # each with the words that it explains
    for form, keys in read_yaml(config_file("words.yaml")).items():
        lines.append((f"{form}: {keys.pop('is')}", form.split()))
        name = form.split()[-1]
        for key, parts in keys.items():
            text = f"  {name}.{key}: {'; '.join(filter(None, parts))}"
            lines.append((text, [name, key, *filter(None, parts[2].split(" or "))]))
    found = [line for line, words in lines if word in words]
    if not found:
        known = suggestion(word, (each for _, words in lines for each in words))
        known = known or "; `pdrom show scene` and `pdrom show effect` list words"
        raise ConfigurationError(f"'{word}': neither a file nor a word of scene files{known}")
    return found


def _hdf5(path: Path, whole: bool) -> Iterator[str]:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            attributes = dict(file.attrs)
            found: list[str] = []
            file.visititems(lambda name, item: found.extend(_item(name, item)))
    except OSError as error:
        raise StorageError(f"{path}: not a readable HDF5 file ({error})") from error
    yield "contents:"
    yield from found
    configuration = attributes.pop("configuration", None)
    if configuration is not None:
        yield from _configuration(json.loads(configuration), whole)
    yield "attributes:"
    own = {k: v for k, v in attributes.items() if k not in RECORD}
    yield from (f"  {name}: {_short(value)}" for name, value in own.items())


def _item(name: str, item: Any) -> Iterator[str]:
    if hasattr(item, "shape"):  # a dataset, no group
        unit = item.attrs.get("unit", "")
        shape = " x ".join(map(str, item.shape)) or "one value"
        more = [f"{k}: {_short(v)}" for k, v in item.attrs.items() if k != "unit"]
        reported = ", ".join(filter(None, [f"{shape} {item.dtype}", unit and f"in {unit}", *more]))
        yield f"  {name}: {reported}"
    elif item.attrs:
        yield f"  {name}/: {', '.join(f'{k} = {_short(v)}' for k, v in item.attrs.items())}"


def _configuration(configuration: Any, whole: bool) -> Iterator[str]:
    yield "configuration:"
    if whole or not isinstance(configuration, dict):
        text = yaml.safe_dump(configuration, sort_keys=False, width=100)
        yield from (f"  {line}" for line in text.splitlines())
        return
    scene: dict[str, Any] = {}
    for name, value in configuration.items():
        if isinstance(value, dict) and {"name", "title"} <= value.keys():  # settings of a scene
            scene, value = value, f"{value['name']} ({value['title']})"
        yield f"  {name}: {_short(value)}"
    yield from _effects(scene)


def _scene(path: Path) -> dict[str, Any]:
    """Return a scene's validated settings from its YAML file; {} if the file is no scene."""
    from pdrom.model.scene import SceneConfig

    keys = named(read_yaml(path), path.stem)
    scene = isinstance(keys, dict) and "effects" in keys
    return validate(SceneConfig, keys, str(path)).model_dump(mode="json") if scene else {}


def _effects(scene: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each effect of a ``scene``: its keys with values and units."""
    yield from [f"iterations: {scene['iterations']}", "effects:"] if scene else []
    words = read_yaml(config_file("words.yaml"))
    for own in scene.get("effects", ()):
        known = words.get(f"effect {own['effect']}", {})
        given = [key for key in known if own.get(key) not in (None, [])]
        told = ", ".join(f"{key} {own[key]} {known[key][0]}".rstrip() for key in given)
        yield f"  {_short(own['effect'] + ': ' + told)}"


def _table(path: Path) -> Iterator[str]:
    from pandas.api.types import is_numeric_dtype

    from pdrom.core.store import read_table

    table = read_table(path, result=False)
    yield f"{len(table)} rows of {len(table.columns)} columns:"
    for name in table.columns:
        values = table[name].dropna()
        if is_numeric_dtype(values) and len(values):
            content = f"{values.min():.4g} to {values.max():.4g}"
        else:
            different = [*dict.fromkeys(map(str, values))]
            content = ", ".join([*different[:4], *["..."] * (len(different) > 4)]) or "empty"
        yield f"  {name}: {content}"


def _short(value: Any) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


COMMAND = Command(
    "Describe a result file (content, units, provenance), or explain a word of scene files",
    "pdrom show results/fom/spring_oop/train.h5",
    {
        "file": text("FILE", "result file, scene file, or a word such as spring or scene"),
        "--configuration": flag("print the whole configuration, as YAML"),
    },
    perform,
)
