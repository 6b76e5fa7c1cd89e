"""What an experiment declares: settings, files that it reads and writes, label, and its function.

A module of this package with an ``EXPERIMENT`` is an experiment. The record of its inputs says of
each field where the file lies::

    @dataclass(frozen=True)
    class Inputs:
        mesh: Annotated[File, MESH]                      # of the job's scene
        samplings: Annotated[list[File], Every(SAMPLING)]  # all that agree with the job's labels

The labels of a job (scene, group ...) are those of the paths that it writes.
"""

import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from importlib import import_module
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from pydantic import BaseModel

from pdrom.core.paths import File, Place
from pdrom.core.reads import EachOf, Every, ProjectFile, SourcesOf
from pdrom.core.yamlfile import ConfigModel

Source = Place | Every | EachOf | ProjectFile | SourcesOf


class JobSettings(ConfigModel):
    """Base of an experiment's settings: exactly what a job depends on beside its files."""

    @property
    def loaded(self) -> list[str]:
        """Modules that these settings name, such as the effects of a scene (for fingerprints)."""
        return sorted(set(_modules(self)))


@dataclass(frozen=True)
class Nothing:
    """Inputs of an experiment that reads no file."""


@dataclass(frozen=True)
class Experiment:
    """A question that the study asks.

    name : of its rule
    label : what a run prints, with labels in braces
    run : function of typed settings, inputs and outputs, whose annotations are the declaration
    alone : it measures times, so that nothing else may run beside it
    """

    name: str
    label: str
    run: Callable[[Any, Any, Any], None]
    alone: bool = False

    @cached_property
    def settings(self) -> type[JobSettings]:
        """Model of the settings."""
        return get_type_hints(self.run)["settings"]

    @cached_property
    def inputs(self) -> dict[str, Source]:
        """Where each input lies."""
        return _sources(get_type_hints(self.run)["inputs"])

    @cached_property
    def outputs(self) -> dict[str, Place]:
        """Where each output lies."""
        return _sources(get_type_hints(self.run)["outputs"])

    @property
    def module(self) -> str:
        """Module that holds the experiment."""
        return self.run.__module__

    @property
    def labels(self) -> list[str]:
        """Names of a job's labels."""
        return list(dict.fromkeys(name for p in self.outputs.values() for name in p.labels))

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Run a job from plain settings and paths, as the workflow knows them.

        Raises
        ------
        ValidationError
            If the settings are not those that the declaration asks for.
        """
        hints = get_type_hints(self.run)
        self.run(
            self.settings.model_validate(settings),
            hints["inputs"](**{k: _record(s, inputs[k]) for k, s in self.inputs.items()}),
            hints["outputs"](**{k: _record(s, outputs[k]) for k, s in self.outputs.items()}),
        )


def load(module: str) -> Experiment:
    """The experiment of a module, and nothing else, is imported."""
    return import_module(module).EXPERIMENT


def experiments(package: str = __package__) -> list[Experiment]:
    """Every experiment of a package, sorted by name."""
    found = [getattr(module, "EXPERIMENT", None) for module in _modules_of(package)]
    return sorted((e for e in found if e is not None), key=lambda e: e.name)


def _modules_of(package: str) -> Iterator[Any]:
    parent = import_module(package)
    for info in pkgutil.walk_packages(parent.__path__, f"{package}."):
        yield import_module(info.name)


def _sources(record: type) -> dict[str, Any]:
    hints = get_type_hints(record, include_extras=True)
    return {field.name: _source(hints[field.name]) for field in fields(record)}


def _source(hint: Any) -> Any:
    if get_origin(hint) is not Annotated:
        raise TypeError(f"{hint}: an annotation with the place of the file is required")
    return get_args(hint)[1]


def _record(source: Source, value: Any) -> str | list[str] | File | list[File]:
    """Paths with their labels, where they have any."""
    match source:
        case Place():
            return source.file(str(value))
        case Every() | EachOf():
            return source.place.files(map(str, value))
        case ProjectFile():
            return str(value)
        case SourcesOf():
            return [str(path) for path in value]


def _modules(value: Any) -> Iterator[str]:
    """``modules`` of every model inside ``value``."""
    if isinstance(value, BaseModel):
        yield from getattr(value, "modules", ())
        for name in type(value).model_fields:
            yield from _modules(getattr(value, name))
    elif isinstance(value, Mapping):
        for entry in value.values():
            yield from _modules(entry)
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from _modules(entry)
