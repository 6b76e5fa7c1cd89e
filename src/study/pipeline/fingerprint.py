"""Fingerprints (hashes) of the code that a workflow step runs, without comments and docstrings.

Snakemake notices a change of a rule's parameters but not of a module that its script imports. A
rule therefore carries the fingerprint of the modules it uses as a parameter. Snakemake also reruns
a job if its script's mtime is newer than its results; a clock error or a copy makes every script
newer, so that the code of a script is a parameter of its rule as well.
"""

import ast
import hashlib
from functools import cache
from itertools import compress
from pathlib import Path
from typing import Any

import pdrom
import study
from pdrom.core.errors import ConfigurationError
from pdrom.core.registry import Registry

PACKAGES = {
    name: Path(package.__path__[0]) for name, package in (("pdrom", pdrom), ("study", study))
}
# Modules left out of fingerprints, so that a new kind of file causes no rerun: they only define
# paths of files. Paths change no result, and Snakemake itself compares the paths of a job's files.
LAYOUT = {"study.artifact.paths", "study.artifact.reads"}
SCRIPTS = Path("workflow/scripts")


@cache
def fingerprint(*places: str) -> str:
    """SHA-256 over the given modules and all modules of these packages that they import.

    Imports are found statically, inside functions too. A registry is a mapping of names to strings
    "module:attribute" that are loaded on demand. Its entries are not followed: the caller passes
    those that it uses, written as in the registry.

    Parameters
    ----------
    places : modules, or "module:attribute" for an entry of a registry

    Raises
    ------
    ConfigurationError
        If a module does not exist.
    """
    digest = hashlib.sha256()
    for place in sorted({place for place in places if ":" in place}):
        digest.update(f"{place}\n".encode())
    for name in closure(*places):
        digest.update(f"{name} {_read(name)[1]}\n".encode())
    return digest.hexdigest()


def closure(*places: str) -> list[str]:
    """Sorted names of all modules that `fingerprint` of ``places`` covers."""
    reached: set[str] = set()
    waiting = [place.partition(":")[0] for place in places]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += _read(name)[0]
    return sorted(reached)


@cache
def _locate(module: str) -> Path | None:
    package, *parts = module.split(".")
    if package not in PACKAGES:
        return None
    base = PACKAGES[package].joinpath(*parts)
    candidates = (base / "__init__.py", base.with_suffix(".py"))
    return next((path for path in candidates if path.is_file()), None)


@cache
def _read(module: str) -> tuple[list[str], str]:
    """Names of the project's modules that ``module`` imports, and the hash of its code.

    Parent packages of the modules are included; imports inside functions are found, too.
    """
    path = _locate(module)
    if path is None:
        raise ConfigurationError(f"fingerprint: no module '{module}' in the packages")
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found: set[str] = set()
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    for parts in [name.split(".") for name in found]:
        found |= {".".join(parts[:i]) for i in range(1, len(parts))}
    known = {name for name in found if _locate(name) is not None}
    # leave out the __init__ files of top-level packages, which contain the version only
    return sorted(known - {*PACKAGES, module} - LAYOUT), digest_of_code(tree, module)


def _statements(tree: ast.AST) -> list[ast.AST]:
    """Return ``tree`` and all statements in it; expressions are not visited, which saves time."""
    found = [tree]
    for node in found:  # the list grows during the loop
        for field in ("body", "handlers", "orelse", "finalbody", "cases"):
            found += getattr(node, field, ())
    return found


def digest_of_code(tree: ast.Module, module: str = "") -> str:
    """Hash of parsed code without comments, layout, docstrings and references to other modules.

    The references are registry entries "module:attribute" for modules other than ``module``.
    """
    for node in _statements(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            texts = [s for s in node.body if isinstance(getattr(s, "value", None), ast.Constant)]
            texts = [s for s in texts if isinstance(s, ast.Expr)]  # docstrings
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
    """Checksum of the hand-edited files ``names`` below ``root``, 16 hexadecimal digits.

    Snakemake compares the dates of files, which a copy, an archive or a wrong clock may set back.
    With this checksum as a parameter of a rule, the content of the files decides.
    """
    files = [root / name for name in names]
    content = b"".join(hashlib.sha256(f.read_bytes()).digest() for f in files if f.is_file())
    return hashlib.sha256(content).hexdigest()[:16]


def track_scripts(workflow: Any) -> None:
    """Rerun a rule's jobs when the code of its script, not when the date of the file, changes."""
    # imported here so that a plan can be made without Snakemake
    from snakemake.settings.types import RerunTrigger

    for rule in workflow.rules:
        if rule.script:
            text = (SCRIPTS / Path(rule.script).name).read_text(encoding="utf-8")
            rule.set_params(script=digest_of_code(ast.parse(text))[:16])
    # Snakemake sets its rerun triggers later than this call, so that a property must filter them
    type(workflow).rerun_triggers = property(
        lambda self: frozenset(self.dag_settings.rerun_triggers) - {RerunTrigger.CODE}
    )
