"""The tables of a study: what their rules need."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from pdrom.core import paths
from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.reads import Every, PerScene, Preferred, ProjectFile, Read, Setting, TableOf
from pdrom.model.scene import SceneConfig
from pdrom.pipeline.fingerprint import fingerprint
from pdrom.pipeline.holdings import paths_of, preferred_paths
from pdrom.pipeline.jobs import digest
from pdrom.pipeline.study import Study
from pdrom.tables import declared


class Tables:
    """Rules of the tables: inputs, output, parameters; ``results`` is the results folder."""

    def __init__(self, study: Study, results: str) -> None:
        self._study, self._results = study, results

    def __iter__(self) -> Iterator[str]:
        return iter(declared())

    @property
    def paths(self) -> list[str]:
        """Every table's file."""
        return [self.path(name) for name in self]

    def path(self, name: str) -> str:
        """A table's file."""
        return paths.TABLE.at(self._results, name=name)

    def labels(self, name: str) -> dict[str, str]:
        """How the report lists a table."""
        return {"table": name, "title": declared()[name].title}

    def log(self, name: str) -> str:
        """Log file of the job that makes a table."""
        return f"{self._results}/logs/tables/{name}.log"

    def inputs(self, name: str) -> dict[str, str | list[str]]:
        """Files that a table reads, by the name under which its function gets them.

        Raises
        ------
        ConfigurationError
            If the table reads another one that is not declared.
        """
        reads = declared()[name].reads.items()
        found = {key: self._files(name, read) for key, read in reads}
        return {key: files for key, files in found.items() if files is not None}

    def params(self, name: str) -> dict[str, Any]:
        """What a table depends on beside the dates of its files.

        Raises
        ------
        ConfigurationError
            If the table reads a key that the configuration does not have.
        """
        table = declared()[name]
        edited = [read.path for read in table.reads.values() if isinstance(read, ProjectFile)]
        values = {key: self._value(name, read) for key, read in table.reads.items()}
        return {
            "module": table.module,
            "settings": {key: value for key, value in values.items() if value is not None},
            "content": digest(self._study.root, *edited) if edited else "",
            "code": fingerprint(table.module),
        }

    def _files(self, name: str, read: Read) -> str | list[str] | None:
        match read:
            case Every(place):
                return paths_of(self._study, place, self._results)
            case Preferred():
                return preferred_paths(self._study, read, self._results)
            case TableOf(other):
                if other not in declared():
                    known = choices(other, declared())
                    raise ConfigurationError(f"table {name} reads '{other}': unknown{known}")
                return self.path(other)
            case ProjectFile(path):
                return path
        return None

    def _value(self, name: str, read: Read) -> Any:
        match read:
            case Setting(key):
                return self._setting(name, key)
            case PerScene(key):
                return self._of_scenes(name, key)
        return None

    def _setting(self, name: str, key: str) -> Any:
        value: Any = self._plain_settings
        for part in key.split("."):
            if not isinstance(value, dict) or part not in value:
                known = choices(part, value) if isinstance(value, dict) else ""
                raise ConfigurationError(f"table {name} reads the key '{key}': unknown{known}")
            value = value[part]
        return value

    def _of_scenes(self, name: str, key: str) -> dict[str, Any]:
        if key not in SceneConfig.model_fields:
            known = choices(key, SceneConfig.model_fields)
            raise ConfigurationError(f"table {name}: scenes have no key '{key}'{known}")
        return {scene: plain[key] for scene, plain in self._plain_scenes.items()}

    @cached_property
    def _plain_settings(self) -> dict[str, Any]:
        return self._study.settings.model_dump(mode="json", by_alias=True)

    @cached_property
    def _plain_scenes(self) -> dict[str, dict[str, Any]]:
        return {name: scene.model_dump(mode="json") for name, scene in self._study.scenes.items()}
