"""Fingerprints (hashes) of the code that a workflow step runs, without comments and docstrings.

Snakemake notices a change of a rule's parameters but not of a module that its script imports. A
rule therefore carries the fingerprint of the modules it uses as a parameter. Snakemake also reruns
a job if its script's mtime is newer than its results; a clock error or a copy makes every script
newer, so that the code of a script is a parameter of its rule as well.
"""

import ast
import dis
import hashlib
import re
from functools import cache
from opcode import opmap
from pathlib import Path
from types import CodeType
from typing import Any

import pdrom
import study
from pdrom.core.errors import ConfigurationError
from pdrom.core.registry import Registry

PACKAGES = {
    name: Path(package.__path__[0]) for name, package in (("pdrom", pdrom), ("study", study))
}
# Modules left out of fingerprints: they only define file paths, which change no result, and
# Snakemake compares the paths of a job's files itself. A new kind of file causes no rerun of jobs.
LAYOUT = {"study.artifact.paths", "study.artifact.reads"}
SCRIPTS = Path("workflow/scripts")
_LINE = "__firstlineno__"
_MODULE = rf"(?:{'|'.join(PACKAGES)})\b[\w.]*"
# ``from NAME import (NAMES)``, ``from NAME import NAMES`` or ``import NAME``, inside functions too;
# an import in a docstring's example matches as well and only adds an unneeded dependency
_IMPORT = re.compile(
    rf"^[ ]*(?:from ({_MODULE}) import (?:\(([^)]*)\)|(.*))|import ({_MODULE}))", re.M
)


@cache
def fingerprint(*places: str) -> str:
    """SHA-256 over the given modules and all modules of these packages that they import.

    Imports are found statically, inside functions too. Modules that a registry loads on demand are
    not followed, and registry entries for other modules are ignored: the caller passes the entries
    that it uses, written as in the registry.

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
    for candidate in (base / "__init__.py", base.with_suffix(".py")):
        if candidate.is_file():
            return candidate
    return None


@cache
def _read(module: str) -> tuple[tuple[str, ...], str]:
    """Names of the project's modules that ``module`` imports, and the hash of its code."""
    path = _locate(module)
    if path is None:
        raise ConfigurationError(f"fingerprint: no module '{module}' in the packages")
    source = path.read_text(encoding="utf-8")
    return _imports(source, module), digest_of_source(source, module)


def _imports(source: str, module: str) -> tuple[str, ...]:
    """Modules of these packages that a source text imports, together with their parent packages."""
    found: set[str] = set()
    for name, enclosed, names, plain in _IMPORT.findall(source):
        if plain:
            found.add(plain)
        else:
            listed = re.sub("#.*", "", enclosed or names).split(",")
            found |= {name, *(f"{name}.{entry.split()[0]}" for entry in listed if entry.strip())}
    for parts in [name.split(".") for name in found]:
        found |= {".".join(parts[:i]) for i in range(1, len(parts))}
    known = {name for name in found if _locate(name) is not None}
    # the __init__ files of the top-level packages contain the version only
    return tuple(sorted(known - {*PACKAGES, module} - LAYOUT))


def digest_of_source(source: str, module: str = "") -> str:
    """Hash of source text without comments, layout, docstrings and names of other modules' code.

    These names are registry entries that refer to modules other than ``module``. Compilation drops
    comments, docstrings and assertions, far faster than a walk over the syntax tree.
    """
    program = _without_others(ast.parse(source), module) if Registry.__name__ in source else source
    code = compile(program, "", "exec", dont_inherit=True, optimize=2)
    return hashlib.sha256(_text(code).encode()).hexdigest()


def _text(code: CodeType) -> str:
    """Return the content of compiled code as text, without its line numbers."""
    if _LINE in code.co_names:
        return repr((code.co_name, _of_class(code), code.co_exceptiontable))
    return repr(
        (
            code.co_name,
            code.co_flags,
            (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount),
            _instructions(code.co_code),
            code.co_exceptiontable,
            (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars),
            [_constant(value) for value in code.co_consts],
        )
    )


def _of_class(code: CodeType) -> list[tuple[str, object]]:
    """Instructions of a class body, without the two constants that Python 3.13 adds to it.

    These constants are the line number of the class and the attributes that its methods set.
    """
    steps = [(step.opname, _constant(step.argval)) for step in dis.get_instructions(code)]
    stores = [("STORE_NAME", name) for name in (_LINE, "__static_attributes__")]
    added = {place for i, step in enumerate(steps) if step in stores for place in (i - 1, i)}
    return [step for i, step in enumerate(steps) if i not in added and step[0] != "NOP"]


def _instructions(code: bytes) -> bytes:
    """Return two-byte instructions without NOP, the instruction that replaces a docstring."""
    operations, parts, start = code[::2], [], 0
    while (place := operations.find(opmap["NOP"], start)) >= 0:
        parts.append(code[2 * start : 2 * place])
        start = place + 1
    return b"".join([*parts, code[2 * start :]])


def _constant(value: object) -> object:
    if isinstance(value, CodeType):
        return _text(value)
    # the order of a set differs between processes, so that its elements are sorted
    return sorted(map(repr, value)) if isinstance(value, frozenset) else value


def _without_others(tree: ast.Module, module: str) -> ast.Module:
    """Return the syntax tree without registry entries that refer to other modules."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(ast.Name(Registry.__name__), [_, ast.Dict(keys, values) as entries]):
                kept = [
                    (key, value)
                    for key, value in zip(keys, values, strict=True)
                    if not (isinstance(value, ast.Constant) and isinstance(value.value, str))
                    or value.value.partition(":")[0] == module
                ]
                entries.keys = [key for key, _ in kept]
                entries.values = [value for _, value in kept]
    return tree


def digest(root: Path, *names: str) -> str:
    """Checksum of the hand-edited files ``names`` below ``root``, 16 hexadecimal digits.

    Snakemake compares the dates of files, which a copy, an archive or a wrong clock may set back.
    With this checksum as a parameter of a rule, the content of the files decides.
    """
    files = [root / name for name in names]
    content = b"".join(hashlib.sha256(f.read_bytes()).digest() for f in files if f.is_file())
    return hashlib.sha256(content).hexdigest()[:16]


def track_scripts(workflow: Any) -> None:
    """Make a hash of each rule's script a parameter of the rule, in place of the script's date."""
    # imported late: a plan can be made without Snakemake
    from snakemake.settings.types import RerunTrigger

    for rule in workflow.rules:
        if rule.script:
            text = (SCRIPTS / Path(rule.script).name).read_text(encoding="utf-8")
            rule.set_params(script=digest_of_source(text)[:16])
    # Snakemake sets the rerun triggers after it has read the rules, so that a property changes them
    type(workflow).rerun_triggers = property(
        lambda self: frozenset(self.dag_settings.rerun_triggers) - {RerunTrigger.CODE}
    )
