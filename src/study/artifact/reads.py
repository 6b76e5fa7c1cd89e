"""Declarations of the files and settings that an artifact needs, called its reads.

A read contains no path: it names a kind of file, a table or a key of the configuration. `Sources`
find the paths or the value for a job, given its scene, group ... (``labels``). The artifact's
function receives the ``content`` of files and the ``value`` of settings.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pdrom.core.store import read_table
from study.artifact.paths import Place

Labels = Mapping[str, str]
Paths = str | list[str]
# An object that finds paths and settings for a job's scene, group ...: `study.pipeline.plan.Plan`.
Sources = Any


@dataclass(frozen=True)
class Every:
    """All files of the kind ``place`` that the study makes for the scene, group ... of the job."""

    place: Place

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.files(self.place, labels)

    def content(self, paths: Any) -> Any:
        return self.place.files(map(str, paths))


@dataclass(frozen=True)
class EachOf(Every):
    """One file of the kind ``place`` for each scene, group ... that the setting ``key`` lists."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        entries = sources.value(self.key, labels)
        return [sources.file(self.place, entry.labels) for entry in entries]


@dataclass(frozen=True)
class TableOf:
    """The study's table ``name``, read as a data frame."""

    name: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.table(self.name)

    def content(self, paths: Any) -> Any:
        return read_table(str(paths))


class EditedFiles:
    """Base class for hand-edited input files: a job reruns if their content changes, not dates."""

    def content(self, paths: Any) -> Any:
        return Path(paths) if isinstance(paths, str) else [Path(path) for path in paths]


@dataclass(frozen=True)
class ProjectFile(EditedFiles):
    """A hand-edited file, given by its path in the project."""

    path: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return self.path


@dataclass(frozen=True)
class ProjectFiles(EditedFiles):
    """Hand-edited files, given by their paths in the project."""

    named: tuple[str, ...]

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return list(self.named)


@dataclass(frozen=True)
class SourcesOf(EditedFiles):
    """Hand-edited files, listed by the attribute ``sources`` of the setting ``key``."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return list(sources.value(self.key, labels).sources)


@dataclass(frozen=True)
class Setting:
    """The configuration value of ``key``; dots in the key separate section and entry."""

    key: str

    def value(self, sources: Sources, labels: Labels) -> Any:
        return sources.value(self.key, labels)


@dataclass(frozen=True)
class Settings:
    """Several settings as one Pydantic ``model``; the name of each field is the setting's key."""

    model: type[Any]

    def value(self, sources: Sources, labels: Labels) -> Any:
        fields = self.model.model_fields
        return self.model.model_validate({key: sources.value(key, labels) for key in fields})


# A `Place` (kind of file) as an input is its file for the scene, group ... of the job.
FileRead = Every | TableOf | ProjectFile | ProjectFiles | SourcesOf | Place
SettingRead = Setting | Settings
Read = FileRead | SettingRead
