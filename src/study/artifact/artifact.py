"""An artifact of the study: what it reads, what it writes, and the function that makes it.

A module declares one above its function, which gets what it reads and writes by name::

    @experiment(
        "POD of {group} in {scene} ({basis})",
        reads={"snapshots": SNAPSHOTS, "spec": Setting("basis")},
        writes={"out": BASIS},
    )
    def pod(snapshots: File, spec: BasisSpec, out: File) -> None: ...

Settings are validated by the annotations of the function, and a job depends on nothing else. The
labels of a job (scene, group ...) are those of the paths that it writes.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pydantic import BaseModel, TypeAdapter

from pdrom.core.provenance import made_by
from study.artifact.paths import Place
from study.artifact.reads import FileRead, Labels, One, Paths, Read, SettingRead, Sources

A = TypeVar("A", bound="Artifact")


@dataclass(frozen=True)
class Artifact:
    """Product of the study, made by one function.

    name : that of the function
    title : printed by a run, with labels in braces
    reads : by the names of the function's parameters
    writes : kinds of files by the names of the parameters that receive them
    alone : it measures times, so that nothing else may run at the same time
    """

    name: str
    title: str
    reads: Mapping[str, Read]
    writes: Mapping[str, Place]
    function: Callable[..., Any]
    alone: bool = False

    @property
    def rule(self) -> str:
        """Name of the rule that makes it."""
        return self.name

    @property
    def module(self) -> str:
        """Module that holds it."""
        return self.function.__module__

    @property
    def address(self) -> str:
        """Module and name, see `load`."""
        return f"{self.module}:{self.name}"

    @property
    def labels(self) -> list[str]:
        """Names of a job's labels."""
        return list(dict.fromkeys(name for place in self.writes.values() for name in place.labels))

    @property
    def files(self) -> dict[str, FileRead]:
        """Reads from files, by name."""
        return {name: read for name, read in self.reads.items() if isinstance(read, FileRead)}

    @cached_property
    def types(self) -> dict[str, TypeAdapter[Any]]:
        """Types of the settings, by name."""
        hints = get_type_hints(self.function, include_extras=True)
        settings = [name for name, read in self.reads.items() if isinstance(read, SettingRead)]
        return {name: TypeAdapter(hints[name]) for name in settings}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the function."""
        return self.function(*arguments, **named)

    def inputs(self, sources: Sources, labels: Labels) -> dict[str, Paths]:
        """Paths among ``sources`` that a job with these ``labels`` reads, by name."""
        return {name: read.paths(sources, labels) for name, read in self.files.items()}

    def settings(self, sources: Sources, labels: Labels) -> dict[str, Any]:
        """Typed settings of a job by name; ConfigurationError if a key does not exist."""
        found: dict[str, Any] = {}
        for name, read in self.reads.items():
            if isinstance(read, SettingRead):
                value = read.value(sources, labels)
                found[name] = self.types[name].validate_python(value)
        return found

    def plain(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """``settings`` as plain data; a section has the annotated fields only."""
        return {k: self.types[k].dump_python(v, mode="json") for k, v in settings.items()}

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Run a job from plain ``settings`` and paths by name, ``inputs`` and ``outputs``.

        Raises
        ------
        ValidationError
            If the settings are not those that the declaration asks for.
        """
        made = {name: place.file(str(outputs[name])) for name, place in self.writes.items()}
        self.function(**self.read(settings, inputs), **made)

    def read(self, settings: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Arguments of the function: content of the files ``inputs``, and typed ``settings``."""
        content = {name: read.content(inputs[name]) for name, read in self.files.items()}
        return content | {k: t.validate_python(settings[k]) for k, t in self.types.items()}


class Files(Artifact):
    """An artifact whose function gets as ``outputs`` the paths that it writes, by name.

    It looks after its own files: many of them, or in places that may vary.
    """

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Write all of them."""
        self.function(**self.read(settings, inputs), outputs=outputs)


def make(
    address: str,
    rule: str,
    *,
    settings: Mapping[str, Any],
    labels: Labels,
    code: str,
    inputs: Mapping[str, Any],
    outputs: Mapping[str, str],
) -> None:
    """Run a job of the artifact at an address; what it writes says what made it.

    Parameters
    ----------
    code : fingerprint of the code that it runs
    inputs, outputs : paths by name
    rule : name of the workflow's rule, recorded in what is written
    """
    with made_by(rule, {**settings, "labels": dict(labels)}, code):
        load(address).perform(settings, inputs, outputs)


def declare(made: A, *parameters: str) -> A:
    """Return ``made``; TypeError if its function does not take reads and ``parameters``."""
    try:
        inspect.signature(made.function).bind(**made.reads, **dict.fromkeys(parameters))
    except TypeError as error:
        raise TypeError(f"{made.rule}: {error}") from error
    return made


def normal(reads: Mapping[str, Read | Place]) -> dict[str, Read]:
    """``reads``, where a place alone stands for the file of the job."""
    return {k: One(read) if isinstance(read, Place) else read for k, read in reads.items()}


def load(address: str) -> Artifact:
    """Return the artifact of an address ``module:name``; nothing else is imported."""
    module, _, name = address.partition(":")
    made: Artifact = getattr(import_module(module), name)
    return made


@cache
def declared_in(package: str, kind: type[A]) -> dict[str, A]:
    """Return the artifacts of a kind that modules of a package declare, by name, sorted.

    Only modules that import something from that of the kind can declare one: no other is imported.
    """
    root, found = Path(import_module(package).__path__[0]), {}
    for path in root.rglob("*.py"):
        if f"\nfrom {kind.__module__} import " not in path.read_text(encoding="utf-8"):
            continue
        name = ".".join((package, *path.relative_to(root).with_suffix("").parts))
        module = import_module(name.removesuffix(".__init__"))
        for value in vars(module).values():
            if isinstance(value, kind) and value.module == module.__name__:
                found[value.name] = value
    return dict(sorted(found.items()))


def modules_in(value: Any) -> Iterator[str]:
    """Yield the modules that models inside ``value`` name, such as the effects of a scene."""
    if isinstance(value, BaseModel):
        yield from getattr(value, "modules", ())
        for name in type(value).model_fields:
            yield from modules_in(getattr(value, name))
    elif isinstance(value, Mapping):
        for entry in value.values():
            yield from modules_in(entry)
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from modules_in(entry)
