"""The manifest of a study: a list of its result files, with checksums and their origin.

Every successful run writes it. Large files (HDF5) are not read again: they have only the BLAKE2b
digest of their checksum, other files also a SHA-256. Equal results have equal manifests.
"""

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from pdrom.core.errors import StorageError
from pdrom.core.provenance import ORIGIN
from pdrom.core.store import Condition, check_file, write_text
from pdrom.core.store.checksum import Checksum, read_checksum
from pdrom.core.yamlfile import ConfigModel
from study.artifact import paths
from study.pipeline.plan import Plan

LARGE = ".h5"
_ENVIRONMENT = ("pdrom_version", "python_version", "library_versions")


class Entry(ConfigModel):
    """Description of a result file in the manifest: its size, digests and origin.

    sha256 : None for an HDF5 file, or a file that was damaged before the manifest was written
    environment : key of `Manifest.environments` for the software versions that made the file
    """

    bytes: int
    blake2b: str
    sha256: str | None = None
    made_by: str | None = None
    configuration_sha256: str | None = None
    code_sha256: str | None = None
    inputs_sha256: str | None = None
    environment: str | None = None

    def fits(self, path: Path) -> bool:
        """Return whether content and origin of the file ``path`` agree with this entry."""
        checksum = read_checksum(path)
        if checksum is None or checksum.digest != self.blake2b:
            return False
        told = json.loads(checksum.provenance or "{}")
        own = {**self.model_dump(), "file": os.path.normpath(path) if checksum.file else None}
        same = all(told.get(key) == own[key] for key in ORIGIN)
        return same and check_file(path) is Condition.INTACT


class Manifest(ConfigModel):
    """Entries of all result files.

    options : command-line options that name the configuration
    environments : short key -> versions of the package, of Python and of libraries
    files : path of a file, relative to the folder of the manifest -> its entry
    """

    format: Literal[1] = 1
    options: tuple[str, ...]
    environments: dict[str, dict[str, str]]
    files: dict[str, Entry]


def write_manifest(plan: Plan, options: Iterable[str]) -> None:
    """Write the manifest of a study after a successful run."""
    environments: dict[str, dict[str, str]] = {}
    files = {}
    for path in sorted(plan.own_files):
        if checksum := read_checksum(path):
            inside = os.path.relpath(path, plan.results)
            files[inside] = _entry(Path(path), checksum, environments)
    made = Manifest(options=tuple(options), environments=environments, files=files)
    text = f"{made.model_dump_json(indent=1, exclude_none=True)}\n"
    write_text(text, paths.MANIFEST.at(plan.results))


def read_manifest(results: str) -> Manifest:
    """Read the manifest of a folder; StorageError if it is missing, damaged or of old format."""
    path = Path(paths.MANIFEST.at(results))
    if check_file(path) is Condition.DAMAGED:
        raise StorageError(f"{path}: damaged, its content and its checksum differ")
    try:
        return Manifest.model_validate_json(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise StorageError(f"{path}: no manifest of this version of pdrom") from error


def _entry(path: Path, checksum: Checksum, environments: dict[str, dict[str, str]]) -> Entry:
    made = json.loads(checksum.provenance) if checksum.provenance else {}
    made.pop("file", None)
    environment = {name: made.pop(name) for name in _ENVIRONMENT if name in made}
    if environment:
        key = hashlib.sha256(json.dumps(environment, sort_keys=True).encode()).hexdigest()[:8]
        environments[key] = environment
        made["environment"] = key
    if path.suffix != LARGE:
        content = path.read_bytes()
        if hashlib.blake2b(content).hexdigest() == checksum.digest:
            made["sha256"] = hashlib.sha256(content).hexdigest()
    return Entry(bytes=path.stat().st_size, blake2b=checksum.digest, **made)
