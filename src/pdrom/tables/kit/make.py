"""Making a table in a job: files and plain settings in, a CSV file out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pdrom.core.reads import Every, Preferred, ProjectFile, Read, TableOf
from pdrom.core.store import read_table, write_table
from pdrom.tables.kit.find import load


def make_table(
    module: str, inputs: Mapping[str, Any], settings: Mapping[str, Any], output: str
) -> None:
    """Write the table of a module.

    Parameters
    ----------
    inputs : path or paths of what the table reads from files, by name
    settings : values of the configuration that it reads, by name
    """
    made = load(module)
    read = {name: _content(made.reads[name], given) for name, given in inputs.items()}
    write_table(made(**read, **settings), Path(output))


def _content(read: Read, given: Any) -> Any:
    match read:
        case Every(place) | Preferred(place):
            return place.files(given)
        case TableOf():
            return read_table(given)
        case ProjectFile():
            return Path(given)
    raise TypeError(f"{read} is not read from a file")
