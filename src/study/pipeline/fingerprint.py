"""Compute fingerprints: hashes of the code that a job runs, without comments and docstrings.

A rule has the fingerprint of its job's code as a parameter, so that Snakemake reruns the job if the
code changes (docs/decisions/0001-code-fingerprints.md).
"""

import ast
import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from itertools import compress
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.registry import Registry
from pdrom.core.store import write_text
from study.artifact.planned import PACKAGES, SCRIPT, noted, plan

# Modules that only define paths of files. Fingerprints leave them out, so that a new kind of file
# causes no reruns; Snakemake reruns a job if the paths of its files change.
LAYOUT = {"study.artifact.paths", "study.artifact.reads"}


class Memory:
    """JSON data that earlier commands computed, by hash of everything on which they depend.

    path : file with the data; it may be missing, damaged or read-only
    most : number of entries, the newest, that are kept although this command has not used them
    """

    def __init__(self, path: Path, most: int = 0) -> None:
        self._path, self._used, self._most = path, dict[str, Any](), most
        try:
            self._held = dict(json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            self._held = {}

    def get(self, compute: Callable[[], Any], *sources: str) -> Any:
        """Return the result of ``compute``, which depends on ``sources`` and Python's version."""
        key = _key(sources)
        if key not in self._used:
            self._used[key] = self._held[key] if key in self._held else compute()
        return self._used[key]

    def put(self, value: Any, *sources: str) -> None:
        """Store ``value``, which `get` then returns for ``sources``."""
        self._used[_key(sources)] = value
        self._held.pop(_key(sources), None)

    def save(self) -> None:
        """Write the data that `get` has returned to the file, if some of them are new."""
        if not self._used.keys() <= self._held.keys():
            others = [item for item in self._held.items() if item[0] not in self._used]
            kept = dict(others[len(others) - min(len(others), self._most) :])
            with suppress(StorageError):
                write_text(json.dumps(kept | self._used), self._path, with_checksum=False)


def _key(sources: Sequence[str]) -> str:
    return hashlib.sha256(json.dumps([sys.version, *sources]).encode()).hexdigest()


@cache
def memory() -> Memory:
    """Return the `Memory` of data that earlier commands computed in this working directory."""
    return Memory(Path(".cache/plan.json"))


@cache
def fingerprint(*places: str) -> str:
    """Compute SHA-256 of the code of the given modules and all of `PACKAGES` that they import.

    Imports inside functions count. A registry maps names to strings "module:attribute", which are
    imported on demand; its modules are left out unless ``places`` has their entries. Raises
    ConfigurationError if a module does not exist.

    places : names of modules, or "module:attribute" for an entry of a registry
    """
    digest = hashlib.sha256()
    for place in sorted({place for place in places if ":" in place}):
        digest.update(f"{place}\n".encode())
    for name in closure(*places):
        digest.update(f"{name} {_read(name)[1]}\n".encode())
    return digest.hexdigest()


def closure(*places: str) -> list[str]:
    """Return the sorted names of the modules of ``places`` and of all that they import."""
    reached: set[str] = set()
    waiting = [place.partition(":")[0] for place in places]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += _read(name)[0]
    return sorted(reached)


@cache
def _read(module: str) -> tuple[list[str], str]:
    """Return modules of the project that ``module`` imports, their packages, its code's hash."""
    if module not in plan():
        raise ConfigurationError(f"fingerprint: the packages have no module '{module}'")
    text, own = (plan()[name][1] for name in (module, __name__))
    found, code = memory().get(lambda: _parsed(text, module), own, module, text)
    known = {name for name in found if name in plan()}
    # leave out the __init__ files of top-level packages, which contain the version only
    return sorted(known - {*PACKAGES, module} - LAYOUT), code


def _parsed(text: str, module: str) -> tuple[list[str], str]:
    """Return sorted names that the code ``text`` of ``module`` may import, and the code's hash."""
    tree = ast.parse(text)
    found: set[str] = set()
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    for parts in [name.split(".") for name in found]:
        found |= {".".join(parts[:i]) for i in range(1, len(parts))}
    return sorted(found), digest_of_code(tree, module)


def _statements(tree: ast.AST) -> list[ast.AST]:
    """Return ``tree`` and all statements in it; expressions are not visited, which saves time."""
    found = [tree]
    for node in found:  # the list grows during the loop
        for field in ("body", "handlers", "orelse", "finalbody", "cases"):
            found += getattr(node, field, ())
    return found


def digest_of_code(tree: ast.Module, module: str = "") -> str:
    """Compute the hash of parsed code without comments, layout, docstrings, most registry entries.

    Entries "module:attribute" of a `Registry` are left out, except those of ``module``, to which
    the code belongs.
    """
    for node in _statements(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            texts = [s for s in node.body if isinstance(getattr(s, "value", None), ast.Constant)]
            texts = [s for s in texts if isinstance(s, ast.Expr)]  # docstrings, unused constants
            node.body = [s for s in node.body if s not in texts] or [ast.Pass()]
        elif isinstance(node, ast.Assign):
            match node.value:
                case ast.Call(ast.Name(Registry.__name__), [_, ast.Dict(keys, values) as entries]):
                    names = [getattr(value, "value", None) for value in values]
                    own = [not isinstance(n, str) or n.split(":")[0] == module for n in names]
                    entries.keys = [*compress(keys, own)]
                    entries.values = [*compress(values, own)]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def digest(root: Path, *names: str) -> str:
    """Return a checksum (16 hexadecimal digits) of the hand-edited files ``names`` in ``root``."""
    files = [noted(root / name) for name in names]
    content = b"".join(hashlib.sha256(f.read_bytes()).digest() for f in files if f.is_file())
    return hashlib.sha256(content).hexdigest()[:16]


def track_scripts(workflow: Any) -> None:
    """Make Snakemake repeat jobs if the code of their script changes, not if its date does.

    After the files are copied, all dates are new, although no result would change.
    """
    # not imported at the top, so that a plan can be made without Snakemake
    from snakemake.settings.types import RerunTrigger

    for rule in workflow.rules:
        if rule.script:
            text = noted(Path(SCRIPT)).read_text(encoding="utf-8")
            rule.set_params(script=digest_of_code(ast.parse(text))[:16])
    # Snakemake sets its triggers of reruns later; this property removes `CODE` (script changed)
    type(workflow).rerun_triggers = property(
        lambda self: frozenset(self.dag_settings.rerun_triggers) - {RerunTrigger.CODE}
    )
