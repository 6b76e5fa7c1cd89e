"""List the result files of a study in a manifest, with their checksums and origin.

Every successful run writes the manifest. Equal results have equal manifests.
"""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from pdrom.core.errors import StorageError
from pdrom.core.provenance import ORIGIN
from pdrom.core.store import Condition, check_file, write_text
from pdrom.core.store.checksum import read_checksum
from pdrom.core.yamlfile import ConfigModel
from study.artifact import paths
from study.pipeline.plan import Plan


class Entry(ConfigModel):
    """Description of a result file in the manifest: its size, digest and origin."""

    bytes: int
    blake2b: str
    made_by: str | None = None
    configuration_sha256: str | None = None
    code_sha256: str | None = None
    inputs_sha256: str | None = None

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
    files : path of a file, relative to the folder of the manifest -> its entry
    """

    format: Literal[2] = 2
    options: tuple[str, ...]
    files: dict[str, Entry]


def write_manifest(plan: Plan, options: Iterable[str]) -> None:
    """Write the manifest of a study after a successful run."""
    files = {}
    for path in sorted(plan.own_files):
        if checksum := read_checksum(path):
            told = json.loads(checksum.provenance or "{}")
            origin = {key: told[key] for key in ORIGIN if key in told and key != "file"}
            entry = Entry(bytes=Path(path).stat().st_size, blake2b=checksum.digest, **origin)
            files[os.path.relpath(path, plan.results)] = entry
    made = Manifest(options=tuple(options), files=files)
    text = f"{made.model_dump_json(indent=1, exclude_none=True)}\n"
    write_text(text, paths.MANIFEST.at(plan.results))


def read_manifest(results: str) -> Manifest:
    """Read the manifest of a folder; StorageError if it is missing, damaged or of old format."""
    path = Path(paths.MANIFEST.at(results))
    if check_file(path) is Condition.DAMAGED:
        raise StorageError(f"{path}: damaged (its content does not fit its checksum)")
    try:
        return Manifest.model_validate_json(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise StorageError(f"{path}: not a manifest of this version of pdrom") from error
