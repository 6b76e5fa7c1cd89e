"""Compare two results folders of one configuration: runs, and tables without measured times.

Usage: python tests/machines/same_results.py FOLDER FOLDER [--tables-only]

Tables are compared as text, HDF5 files by the bytes of their datasets without ``timings``. The exit
status is 0 for equal folders and 1 for different ones, whose differences are listed.
"""

import argparse
import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import Table

ROOT = Path(__file__).resolve().parents[2]


def without_times(made: Table, rows: pd.DataFrame, root: Path) -> pd.DataFrame:
    """``rows`` of a table, as text, with every cell emptied that depends on timing.

    ``root`` is the folder of the project, for the files that the table reads there.
    """
    cells = [made.timing_columns] * len(rows)
    if made.timed_cells is not None:
        files = {k: root / r.path for k, r in made.reads.items() if isinstance(r, ProjectFile)}
        cells = made.timed_cells(rows, **files)
    timed = [[name in of_row for name in rows] for of_row in cells]
    return rows.astype(object).mask(np.array(timed, dtype=bool).reshape(rows.shape), "").astype(str)


def table_digests(folder: Path) -> dict[str, str]:
    """Digest of each table without its timed cells, by path."""
    found = {}
    for name, table in declared().items():
        path = folder / "tables" / f"{name}.csv"
        if path.is_file():
            found[f"tables/{name}.csv"] = table_digest(table, path, ROOT)
    return found


def table_digest(made: Table, path: Path, root: Path) -> str:
    """Digest of a table without its timed cells; ``root`` as in `without_times`."""
    kept = without_times(made, pd.read_csv(path, dtype=str), root)
    return hashlib.sha256(kept.to_csv().encode()).hexdigest()


def run_digests(folder: Path) -> dict[str, str]:
    """Digest of the datasets of each HDF5 file, by path."""
    paths = sorted(folder.rglob("[!.]*.h5"))
    return {str(path.relative_to(folder)): run_digest(path) for path in paths}


def run_digest(path: Path, attributes: bool = False) -> str:
    """Digest of the datasets of an HDF5 file, and of the ``attributes`` of all that is in it."""
    content = hashlib.sha256()

    def add(name: str, item: h5py.Dataset | h5py.Group) -> None:
        if name.rpartition("/")[2] == "timings":
            return
        content.update(name.encode())
        if attributes:
            content.update(repr(sorted(item.attrs.items())).encode())
        if isinstance(item, h5py.Dataset):
            content.update(np.ascontiguousarray(item[()]).tobytes())

    with h5py.File(path) as file:
        file.visititems(add)
    return content.hexdigest()


def differences(first: dict[str, str], second: dict[str, str]) -> Iterator[str]:
    """Paths whose digests differ, or that only one folder has."""
    for path in sorted(first.keys() | second.keys()):
        if first.get(path) != second.get(path):
            missing = [
                side for side, own in (("first", first), ("second", second)) if path not in own
            ]
            yield f"{path}: {'not in the ' + missing[0] if missing else 'differs'}"


def main() -> None:
    """Compare the folders of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folders", nargs=2, type=Path, metavar="FOLDER")
    parser.add_argument("--tables-only", action="store_true")
    asked = parser.parse_args()
    kinds = {"tables": table_digests} | ({} if asked.tables_only else {"runs": run_digests})
    different: list[str] = []
    for kind, digests in kinds.items():
        first, second = map(digests, asked.folders)
        if not first:
            sys.exit(f"{asked.folders[0]}: holds no {kind}")
        found = list(differences(first, second))
        sys.stdout.write(f"{kind}: {len(first) - len(found)} of {len(first)} equal\n")
        different += found
    sys.stdout.writelines(f"  {line}\n" for line in different)
    sys.exit(1 if different else 0)


if __name__ == "__main__":
    main()
