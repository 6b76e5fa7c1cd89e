"""Declare the inputs of artifacts: files and settings.

A declaration contains no path: it names a kind of file, a table, or a key of the configuration. The
plan of the study (``sources``) finds paths or value for the scene, group ... (``labels``) of a job.
The function of the artifact receives the ``content`` of files and the ``value`` of settings.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.store import read_table
from study.artifact.paths import Place

Labels = Mapping[str, str]
Paths = str | list[str]


def listed(paths: Paths) -> list[str]:
    """Return a list of one or several ``paths``."""
    return [paths] if isinstance(paths, str) else list(paths)


# File in git with those rows of table {} that the long study config/extended.yaml has computed.
RECORD = "config/reference/recorded/{}.csv"
# A `study.pipeline.plan.Plan`, which finds paths and settings for the scene, group ... of a job.
Sources = Any


@dataclass(frozen=True)
class Every:
    """All files of the study that fit ``place`` and the job's labels (scene, group ...)."""

    place: Place

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.files(self.place, labels)

    def content(self, paths: Any) -> Any:
        return [self.place.file(str(path)) for path in paths]


@dataclass(frozen=True)
class EachOf(Every):
    """For each entry (scene, group ...) of setting ``key``, the file whose path fits ``place``."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        entries = sources.value(self.key, labels)
        return [sources.file(self.place, entry.labels) for entry in entries]


@dataclass(frozen=True)
class TableOf:
    """Table ``name`` of the study as a data frame, without columns if the study lacks the table."""

    name: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return sources.table(self.name)

    def content(self, paths: Any) -> Any:
        return read_table(str(paths)) if paths else pd.DataFrame()


class EditedFiles:
    """Base class for files edited by hand; a job reruns if their content, not the date, changes."""

    def content(self, paths: Any) -> Any:
        return Path(paths) if isinstance(paths, str) else [Path(path) for path in paths]


@dataclass(frozen=True)
class ProjectFile(EditedFiles):
    """A file edited by hand, or a tuple of several files, given by paths in the project."""

    path: str | tuple[str, ...]

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return self.path if isinstance(self.path, str) else list(self.path)


@dataclass(frozen=True)
class Recorded(EditedFiles):
    """File `RECORD` with stored rows of table ``name``; no file if setting ``recorded`` is off."""

    name: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return [RECORD.format(self.name)] if sources.value("recorded", labels) else []


@dataclass(frozen=True)
class SourcesOf(EditedFiles):
    """Files edited by hand that the attribute ``sources`` of the setting ``key`` lists."""

    key: str

    def paths(self, sources: Sources, labels: Labels) -> Paths:
        return list(sources.value(self.key, labels).sources)


@dataclass(frozen=True)
class Setting:
    """Value of a ``key`` of the configuration; a dot in the key separates section and entry."""

    key: str

    def value(self, sources: Sources, labels: Labels) -> Any:
        return sources.value(self.key, labels)


@dataclass(frozen=True)
class Settings:
    """Several settings as one Pydantic ``model``; the name of a field is the key of its setting."""

    model: type[Any]

    def value(self, sources: Sources, labels: Labels) -> Any:
        fields = self.model.model_fields
        return self.model.model_validate({key: sources.value(key, labels) for key in fields})


# An input declared as a `Place` (kind of file) is the file of this kind for the job's labels.
FileRead = Every | TableOf | ProjectFile | Recorded | SourcesOf | Place
SettingRead = Setting | Settings
Read = FileRead | SettingRead
