"""Reads of an artifact: files and settings.

A declaration holds no path: it names kinds of files, other tables and keys of the configuration.
The pipeline finds them (`Sources`); the function of the artifact gets their content by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pdrom.core.store import read_table
from study.artifact.paths import Place

Labels = Mapping[str, str]
Paths = str | list[str]


class Sources(Protocol):
    """Answers of a study about its files and settings, for a job with some labels."""

    def file(self, place: Place, labels: Labels) -> str:
        """Return the file of a kind (``place``) that belongs to a job with these ``labels``."""
        ...

    def files(self, place: Place, labels: Labels) -> list[str]:
        """Return every file of a kind (``place``) that agrees with the ``labels`` of a job."""
        ...

    def table(self, name: str) -> str:
        """Return the file of the table ``name``."""
        ...

    def value(self, key: str, labels: Labels) -> Any:
        """Return the value of ``key`` in the configuration, or derived for a job's ``labels``."""
        ...


class FileRead:
    """Something that is read from files."""

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        """Return the path, or all paths, among ``sources`` for a job with these ``labels``."""
        raise NotImplementedError

    def content(self, paths: Any) -> Any:
        """Return what the function of the artifact gets for ``paths``."""
        raise NotImplementedError


class SettingRead:
    """Something that is read from the configuration."""

    def value(self, sources: Sources, labels: Labels) -> Any:
        """Return the value from ``sources`` for a job with these ``labels``."""
        raise NotImplementedError


Read = FileRead | SettingRead


@dataclass(frozen=True)
class One(FileRead):
    """The file of a kind that belongs to the job; declared by its place alone."""

    place: Place

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.file(self.place, labels)

    def content(self, paths: Any) -> Any:
        return self.place.file(str(paths))


@dataclass(frozen=True)
class Every(FileRead):
    """Every file of a kind that the configuration holds and that agrees with the job's labels."""

    place: Place

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.files(self.place, labels)

    def content(self, paths: Any) -> Any:
        return self.place.files(map(str, paths))


@dataclass(frozen=True)
class EachOf(Every):
    """A file for each entry of a setting, which knows its ``labels``, also where some share it."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        entries = sources.value(self.key, labels)
        return [sources.file(self.place, entry.labels) for entry in entries]


@dataclass(frozen=True)
class TableOf(FileRead):
    """A table of the study, by name."""

    name: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.table(self.name)

    def content(self, paths: Any) -> Any:
        return read_table(str(paths))


class EditedFiles(FileRead):
    """Files that people edit: a change of their content counts, not of their dates."""

    def content(self, paths: Any) -> Any:
        return [Path(path) for path in paths]


@dataclass(frozen=True)
class ProjectFile(EditedFiles):
    """A file that people edit, by its path in the project."""

    path: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return self.path

    def content(self, paths: Any) -> Any:
        return Path(paths)


@dataclass(frozen=True)
class ProjectFiles(EditedFiles):
    """Files that people edit, by their paths in the project."""

    named: tuple[str, ...]

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return list(self.named)


@dataclass(frozen=True)
class SourcesOf(EditedFiles):
    """Files that people edit and that a setting names by its property ``sources``."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return list(sources.value(self.key, labels).sources)


@dataclass(frozen=True)
class Setting(SettingRead):
    """A value of the configuration, by its key; dots lead into sections."""

    key: str

    def value(self, sources: Sources, labels: Labels) -> Any:
        return sources.value(self.key, labels)


@dataclass(frozen=True)
class Settings(SettingRead):
    """A model of settings that go together; each of its fields is the setting of that name."""

    model: type[Any]

    def value(self, sources: Sources, labels: Labels) -> Any:
        fields = self.model.model_fields
        return self.model.model_validate({key: sources.value(key, labels) for key in fields})
