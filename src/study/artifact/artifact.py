"""Declare a function that makes files of the study (an artifact), with its inputs and outputs.

The names in ``reads`` and ``writes`` of a decorator are the parameters of the function::

    @experiment(
        "POD of {group} in {scene} ({basis})",
        reads={"snapshots": SNAPSHOTS, "spec": Setting("basis")},
        writes={"out": BASIS},
    )
    def pod(snapshots: File, spec: BasisSpec, out: File) -> None: ...

Settings are validated by the annotations of the function. A job depends only on declared inputs.
Paths of outputs have wildcards (scene, group ...), and an artifact has one job for each combination
of their values. The values in one job are called ``labels`` in the code.
"""

import hashlib
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pkgutil import resolve_name
from typing import Any, ClassVar, TypeVar, get_type_hints

from pydantic import BaseModel, TypeAdapter

from pdrom.core.errors import PdromError
from pdrom.core.provenance import made_by
from pdrom.core.store.checksum import digest_told
from study.artifact.paths import Place
from study.artifact.planned import SCRIPT, plan, refused
from study.artifact.reads import EditedFiles, FileRead, Labels, Read, SettingRead, Sources, listed

A = TypeVar("A", bound="Artifact")


@dataclass(frozen=True)
class Artifact:
    """A function that makes files of the study, with its input and output files.

    A function has a parameter for each output file. If these are many, or are in configurable
    folders, it has a single parameter ``outputs``, which maps names to the paths of all of them.

    name : name of the function
    title : message when a job starts; scene etc. of the job replace ``{scene}`` etc.
    reads : parameter of the function -> declared input (files or a setting)
    writes : parameter of the function -> kind of output file
    alone : True if the function measures times, so that no other job may run meanwhile
    """

    name: str
    title: str
    reads: Mapping[str, Read]
    writes: Mapping[str, Place]
    function: Callable[..., Any]
    alone: bool = False
    rule_pattern: ClassVar[str] = "{}"

    @property
    def rule(self) -> str:
        """Name of the workflow rule that makes the artifact."""
        return self.rule_pattern.format(self.name)

    @property
    def address(self) -> str:
        """Address ``module:name`` of the artifact."""
        return f"{self.function.__module__}:{self.name}"

    @property
    def labels(self) -> list[str]:
        """Names of the wildcards (scene, group ...) in the paths of the output files."""
        return list(dict.fromkeys(name for place in self.writes.values() for name in place.labels))

    @property
    def files(self) -> dict[str, FileRead]:
        """Mapping of parameters to declared inputs that are files; all others are settings."""
        reads = self.reads.items()
        return {name: read for name, read in reads if not isinstance(read, SettingRead)}

    def paths(self, inputs: Mapping[str, Any], edited: bool) -> list[str]:
        """Return paths of ``inputs`` that are ``edited`` by hand, or else those that jobs make."""
        reads = self.files.items()
        names = [name for name, read in reads if isinstance(read, EditedFiles) == edited]
        return [str(path) for name in names for path in listed(inputs[name])]

    @cached_property
    def types(self) -> dict[str, TypeAdapter[Any]]:
        """Mapping: parameter of the function for a setting -> Pydantic adapter for its value."""
        hints = get_type_hints(self.function, include_extras=True)
        settings = [name for name, read in self.reads.items() if isinstance(read, SettingRead)]
        return {name: TypeAdapter(hints[name]) for name in settings}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self.function(*arguments, **named)

    def settings(self, sources: Sources, labels: Labels) -> dict[str, Any]:
        """Map parameters to the job's settings; ConfigurationError if a setting is missing."""
        reads = [(name, read) for name, read in self.reads.items() if isinstance(read, SettingRead)]
        values = {name: read.value(sources, labels) for name, read in reads}
        return {name: self.types[name].validate_python(value) for name, value in values.items()}

    def plain(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Convert ``settings`` to JSON data, without fields that their parameter's type lacks."""
        return {k: self.types[k].dump_python(v, mode="json") for k, v in settings.items()}

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Run a job; arguments map parameters to settings (JSON data), input and output paths."""
        made: dict[str, Any] = {"outputs": outputs}
        if "outputs" not in inspect.signature(self.function).parameters:
            made = {name: place.file(str(outputs[name])) for name, place in self.writes.items()}
        self.function(**self.read(settings, inputs), **made)

    def read(self, settings: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Map parameters of the function to contents of ``inputs`` and validated ``settings``."""
        content = {name: read.content(inputs[name]) for name, read in self.files.items()}
        return content | {k: t.validate_python(settings[k]) for k, t in self.types.items()}


def recorded(
    made: Artifact, settings: Any, labels: Labels, code: str, content: str, digests: Iterable[str]
) -> AbstractContextManager[None]:
    """Within this context, files record the job that makes them, with ``digests`` of its inputs."""
    inputs = hashlib.sha256("\n".join((content, *digests)).encode()).hexdigest()
    return made_by(made.rule, {**settings, "labels": dict(labels)}, code, inputs)


def make(
    address: str, code: str, labels: Labels, content: str = "", **job: Mapping[str, Any]
) -> None:
    """Run a job of the artifact at ``address``; its files record rule, settings, code and inputs.

    Other arguments are attributes of a `study.pipeline.plan.Job`. Raises StorageError if an input
    is damaged or was copied from another result (`damaged_set_aside`), and PdromError if a file
    that the job reads was edited after the run was planned.
    """
    made: Artifact = resolve_name(address)
    digests = map(digest_told, made.paths(job["inputs"], edited=False))
    try:
        with recorded(made, job["settings"], labels, code, content, digests):
            made.perform(**job)
    finally:
        for message in refused([SCRIPT, *made.paths(job["inputs"], edited=True)]):
            raise PdromError(message)


def declare(made: A, *parameters: str) -> A:
    """Return ``made``; TypeError unless its function takes its inputs and output ``parameters``."""
    try:
        inspect.signature(made.function).bind(**made.reads, **dict.fromkeys(parameters))
    except TypeError as error:
        raise TypeError(f"{made.rule}: {error}") from error
    return made


@cache
def declared_in(package: str, kind: type[A]) -> dict[str, A]:
    """Return all artifacts of the class ``kind`` in the modules of a package, sorted by name."""
    found = {}
    # to save time, do not import modules that import nothing from the module of ``kind``
    above, _, own = kind.__module__.rpartition(".")
    needed = f"\nfrom {kind.__module__} import ", f"\nfrom {above} import {own}"
    for name, (_, text) in plan().items():
        if not name.startswith(f"{package}.") or not any(line in text for line in needed):
            continue
        module = import_module(name)
        for value in vars(module).values():
            if isinstance(value, kind) and value.function.__module__ == module.__name__:
                found[value.name] = value
    return dict(sorted(found.items()))


def modules_in(value: Any) -> Iterator[str]:
    """Yield names of modules from the attribute ``modules`` of Pydantic models inside ``value``."""
    if isinstance(value, BaseModel):
        yield from getattr(value, "modules", ())
        for name in type(value).model_fields:
            yield from modules_in(getattr(value, name))
    elif isinstance(value, (Mapping, list, tuple)):
        for entry in value.values() if isinstance(value, Mapping) else value:
            yield from modules_in(entry)
