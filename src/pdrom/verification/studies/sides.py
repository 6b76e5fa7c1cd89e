"""One of two studies: a folder of results, read by its manifest and left as it is."""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from pdrom.core.errors import ConfigurationError, StorageError, choices
from pdrom.core.paths import MACHINE, RESULTS, TABLE, Place
from pdrom.core.store import Condition, check_file, read_checksum, read_table
from pdrom.pipeline.commandline import YAML
from pdrom.pipeline.folders import folders
from pdrom.pipeline.manifest import Manifest, read_manifest
from pdrom.verification.studies.archive import unpack


def place_of(given: str) -> Path:
    """Folder of results or archive that ``given`` means.

    Parameters
    ----------
    given : the folder or archive itself, a configuration's file, or the name of a configuration
        that has results

    Raises
    ------
    ConfigurationError
        It means none of them.
    """
    path = Path(given)
    if path.is_file() and path.suffix in YAML:
        return Path(folders([path], ()).results)
    if path.exists():
        return path
    named = {each.name: each for each in Path(RESULTS, "studies").glob("*")}
    named["default"] = Path(RESULTS)
    if given not in named:
        what = "no folder of results, archive of ./reproduce bundle or configuration with results"
        raise ConfigurationError(f"compare: {given}: {what}{choices(given, sorted(named))}")
    return named[given]


class Made(NamedTuple):
    """Bytes of a result and what made them: digest, hashes of its settings and of its code."""

    digest: str
    settings: str | None
    code: str | None


@dataclass(frozen=True)
class Side:
    """A study.

    name : its folder or archive
    folder : where its files are read
    """

    name: str
    folder: Path
    manifest: Manifest

    @classmethod
    def read(cls, place: Path, room: Path) -> "Side":
        """Read ``place``: a folder, or an archive by way of the empty folder ``room``.

        Raises
        ------
        StorageError
            It holds no results of a study, or damaged ones.
        """
        if place.is_file():
            unpack(place, room)
        folder = room if place.is_file() else place
        try:
            side = cls(str(place), folder, read_manifest(str(folder)))
            if not side.tables:
                raise StorageError(f"{folder}: its manifest lists no table of a study")
            return side
        except StorageError as error:
            raise StorageError(str(error).replace(str(folder), str(place))) from error

    @cached_property
    def made(self) -> dict[str, Made]:
        """Results by name: those of the manifest, and tables and figures made after it."""
        listed = self.manifest.files.items()
        found = {n: Made(e.blake2b, e.configuration_sha256, e.code_sha256) for n, e in listed}
        later = [*self.folder.glob("tables/*.csv"), *self.folder.glob("figures/*.png")]
        for name in sorted({*found, *(str(path.relative_to(self.folder)) for path in later)}):
            checksum = read_checksum(self.folder / name)
            if checksum is not None:
                job = json.loads(checksum.provenance or "{}")
                hashes = job.get("configuration_sha256"), job.get("code_sha256")
                found[name] = Made(checksum.digest, *hashes)
        return found

    def names(self, place: Place) -> Iterator[str]:
        """Names of the results of a kind, ``place``."""
        for name in self.made:
            with suppress(StorageError):
                if place.pattern.format(**place.file(name).labels) == name:
                    yield name

    def file(self, name: str) -> Path:
        """Path of the result ``name``; StorageError if it is missing, or not what was written."""
        path, entry = self.folder / name, self.manifest.files.get(name)
        if not path.is_file():
            raise StorageError(f"{self.name}/{name}: not there, and the manifest lists it")
        listed = entry is not None and entry.sha256 is not None and entry.fits(path)
        if not listed and check_file(path) is not Condition.INTACT:
            raise StorageError(f"{self.name}/{name}: damaged, or not the one in the manifest")
        return path

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Tables by name."""
        files = {TABLE.file(name)["name"]: name for name in self.names(TABLE)}
        return {key: read_table(self.file(name), result=False) for key, name in files.items()}

    @cached_property
    def facts(self) -> dict[str, str]:
        """Facts about the run by name: its configuration, machine, code and libraries."""
        facts = {"configuration": " ".join(self.manifest.options) or "the full study"}
        for name in self.names(MACHINE):
            for key, value in json.loads(self.file(name).read_text("utf-8")).items():
                many = value.items() if isinstance(value, dict) else ()
                facts[key] = ", ".join(" ".join(map(str, one)) for one in many) or str(value)
        facts.pop("kernels", None)
        return facts
