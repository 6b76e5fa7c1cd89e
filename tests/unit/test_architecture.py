"""The architecture: imports between rooms, cycles, private names, sizes."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from places import ROOT

SOURCE = ROOT / "src"
# A room imports from itself and from rooms left of it; so the study calls pdrom, never the other
# way.
ROOMS = (
    "pdrom.core", "pdrom.model", "pdrom.reduction", "pdrom.view", "pdrom.api", "pdrom.command",
    "study.artifact", "study.experiments", "study.tables", "study.figures", "study.paper",
    "study.live", "study.article", "study.pipeline", "study.verification",
)  # fmt: skip
PACKAGES = ("pdrom", "study")
NUMERICS = ("pdrom.core", "pdrom.model", "pdrom.reduction", "study.experiments", "study.tables")
MODULE_LINES, CLASS_LINES = 500, 200
# Words with which a docstring gives the reason for a longer module.
REASON = "one module because"


def modules() -> dict[str, Path]:
    found = {}
    for path in sorted(path for name in PACKAGES for path in (SOURCE / name).rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(MODULES[name].read_text(encoding="utf-8"))


def imports(name: str) -> Iterator[tuple[str, str | None]]:
    """(module, name in it or None) of every import of a module, also inside functions.

    Imports for type checking count, too, because a reader follows them.
    """
    for node in ast.walk(tree(name)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative imports hide where a module lies"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield (whole, None) if whole in MODULES else (str(node.module), alias.name)


def own_imports(name: str) -> Iterator[str]:
    return (module for module, _ in imports(name) if module in MODULES and module not in PACKAGES)


def room(name: str) -> str | None:
    parts = name.split(".")
    return ".".join(parts[:2]) if len(parts) > 1 else None


def folder(name: str) -> str:
    path = MODULES[name]
    return ".".join(path.parent.relative_to(SOURCE).parts)


def test_every_folder_of_the_package_is_a_room() -> None:
    folders = {
        f"{package}.{path.name}"
        for package in PACKAGES
        for path in (SOURCE / package).iterdir()
        if path.is_dir() and path.name != "__pycache__"
    }
    assert folders == set(ROOMS)


def test_imports_between_rooms_point_one_way() -> None:
    wrong = [
        f"{name} imports {other}"
        for name in MODULES
        for other in own_imports(name)
        if room(name) in ROOMS and ROOMS.index(str(room(other))) > ROOMS.index(str(room(name)))
    ]
    assert wrong == []


def cycle(edges: dict[str, set[str]]) -> list[str]:
    """Nodes of a cycle, empty without a cycle."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        found: list[str] = error.args[1]
        return found
    return []


def test_no_module_and_no_folder_imports_itself_through_others() -> None:
    edges = {name: set(own_imports(name)) - {name} for name in MODULES if name not in PACKAGES}
    assert cycle(edges) == []
    # modules of a folder count as one; a folder may use folders inside it, but not the reverse
    edges = {}
    for name in MODULES:
        for other in own_imports(name):
            if folder(other) != folder(name):
                edges.setdefault(folder(name), set()).add(folder(other))
    assert cycle(edges) == []


def test_private_names_stay_in_their_module() -> None:
    wrong = [
        f"{name}: {module}.{imported or ''}"
        for name in MODULES
        for module, imported in imports(name)
        if module in MODULES
        and any(
            part.startswith("_") and not part.startswith("__")
            for part in (*module.split("."), imported or "")
        )
    ]
    assert wrong == []


def test_numerics_never_import_plotting() -> None:
    wrong = [
        f"{name} imports {module}"
        for name in MODULES
        for module, _ in imports(name)
        if room(name) in NUMERICS and module.split(".")[0] in ("matplotlib", "mpl_toolkits")
    ]
    assert wrong == []


def test_modules_and_classes_are_not_too_long() -> None:
    """A longer module gives the reason in its docstring; classes have no exception."""
    wrong = []
    for name, path in MODULES.items():
        lines = len(path.read_text(encoding="utf-8").splitlines())
        why = REASON in " ".join((ast.get_docstring(tree(name)) or "").split())
        if lines > MODULE_LINES and not why:
            wrong.append(f"{name}: {lines} lines")
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.ClassDef):
                size = (node.end_lineno or 0) - node.lineno + 1
                if size > CLASS_LINES:
                    wrong.append(f"{name}.{node.name}: {size} lines")
    assert wrong == []
