"""What an artifact (a table, a figure) says that it reads; the pipeline finds it.

A declaration holds no path: it names kinds of files, other tables and keys of the configuration.
"""

from dataclasses import dataclass

from pdrom.core.paths import Place


@dataclass(frozen=True)
class Every:
    """Every file of a kind that the configuration holds, handed over with its labels."""

    place: Place


@dataclass(frozen=True)
class TableOf:
    """A table of the study, by name."""

    name: str


@dataclass(frozen=True)
class Setting:
    """A value of the configuration, by its key; dots lead into sections."""

    key: str


@dataclass(frozen=True)
class PerScene:
    """A value of every scene's configuration, as a mapping from the scene's name."""

    key: str


@dataclass(frozen=True)
class EachOf:
    """One file of a kind for each entry of a setting, in order; an entry knows its ``labels``."""

    key: str
    place: Place


@dataclass(frozen=True)
class Preferred:
    """One file of a kind for each set of its other labels.

    The one whose ``label`` has this ``value``, where the configuration holds it, else the first.
    """

    place: Place
    label: str
    value: str


@dataclass(frozen=True)
class ProjectFile:
    """A file that people edit, by its path in the project."""

    path: str


@dataclass(frozen=True)
class SourcesOf:
    """Files that people edit and that a setting names by its property ``sources``."""

    key: str


@dataclass(frozen=True)
class Chosen:
    """Files of a kind for the scenes, groups and methods that the artifact's options choose.

    first : only for the first experiment and the first method that exist
    """

    place: Place
    first: bool = False


@dataclass(frozen=True)
class Published:
    """A table of the published code's own output, by name, where the options ask for one."""

    name: str


Read = Every | TableOf | Setting | PerScene | Preferred | ProjectFile
