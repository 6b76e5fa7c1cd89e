"""Declared tables, found by listing a package: there is no list of them."""

import pkgutil
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from pdrom.tables.kit.declaration import Table


@cache
def declared(package: str = "pdrom.tables") -> dict[str, Table[Any]]:
    """Tables of a package and of those inside it by name, in alphabetical order."""
    folder = import_module(package).__path__
    names = sorted(info.name for info in pkgutil.walk_packages(folder, f"{package}."))
    found = [t for name in names for t in _tables_of(import_module(name))]
    return {table.name: table for table in sorted(found, key=lambda t: t.name)}


def load(module: str) -> Table[Any]:
    """The table of a module, without a look at others; ValueError unless there is exactly one."""
    (table,) = _tables_of(import_module(module))
    return table


def timing_columns() -> dict[str, tuple[str, ...]]:
    """Columns of each table in which two runs on one machine may differ."""
    return {name: t.timing_columns for name, t in declared().items() if t.timing_columns}


def _tables_of(module: ModuleType) -> list[Table[Any]]:
    """Tables that a module makes, not those that it imports."""
    found = [value for value in vars(module).values() if isinstance(value, Table)]
    return [table for table in found if table.module == module.__name__]
