"""Find the results folder of a configuration; each configuration has a different folder."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml
from study.artifact.paths import RESULTS
from study.paper.source import DOCUMENTS

DEFAULT = "config/default.yaml"
OWN = "own"
KEY = "study"
_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")


@dataclass(frozen=True)
class Folders:
    """Path of the results folder, and path of the manuscript's PDF made from these results."""

    results: str = RESULTS
    manuscript: str = "paper/main.pdf"

    @property
    def documents(self) -> dict[str, str]:
        """Name of a document ("main", "supplement") -> path of its PDF."""
        supplement = Path(self.manuscript).with_name("supplement.pdf").as_posix()
        return dict(zip(DOCUMENTS, (self.manuscript, supplement), strict=True))


def folders(configfiles: Iterable[str | Path], settings: Iterable[str]) -> Folders:
    """Return the folders of a configuration.

    The default configuration has the folders ``results`` and ``paper``. Every other configuration
    has ``results/studies/NAME``. NAME is the value of its key ``study``; without this key, it is
    the name of the last of ``configfiles`` without suffix; without files, it is `OWN`. Raises
    ConfigurationError unless NAME consists of at most 60 letters, digits, _ and -.
    """
    default, pairs = Path(DEFAULT).resolve(), list(settings)
    files = [str(file) for file in configfiles if Path(file).resolve() != default]
    if not files and not pairs:
        return Folders()
    contents = [read_yaml(Path(file)) for file in reversed(files)]
    named = [pair.removeprefix(f"{KEY}=") for pair in reversed(pairs) if pair.startswith(f"{KEY}=")]
    named += [str(c[KEY]) for c in contents if isinstance(c, dict) and c.get(KEY) is not None]
    name = [*named, Path(files[-1]).stem if files else OWN][0]
    if not _NAME.fullmatch(name):
        raise ConfigurationError(
            f"{KEY} = '{name}': cannot name a folder; use at most 60 letters, digits, _ and - "
            f"(if this is the name of the configuration file, set the key {KEY})"
        )
    results = f"{RESULTS}/studies/{name}"
    return Folders(results, f"{results}/paper/main.pdf")
