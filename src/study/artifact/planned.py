"""Import the code with which a run was planned, even if its files are edited during the run.

A run stores the code that its plan has read in a file, from which its jobs import all modules
(docs/decisions/0001-code-fingerprints.md).

``python -m study.artifact.planned MODULE ARGUMENTS`` runs a module in a new process of a job.
"""

import hashlib
import json
import marshal
import os
import runpy
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from typing import Any

PACKAGES = ("pdrom", "study")
SCRIPT = "workflow/scripts/artifact.py"
# File in which a run stores its plan; environment variable with the file's path, for jobs.
PLAN, KEPT = Path(".snakemake/plan.json"), "PDROM_PLAN"


@cache
def kept() -> tuple[dict[str, tuple[str, str]], dict[str, int]]:
    """Return the files that the plan has read: module -> path, text; other file -> `changed`."""
    if place := os.environ.get(KEPT):
        return tuple(json.loads(Path(place).read_bytes()))
    root, found = Path(__file__).resolve().parents[2], {}
    for path in sorted(path for name in PACKAGES for path in (root / name).rglob("*.py")):
        if path.is_file():  # an editor's lock file may be a broken link
            name = ".".join(path.relative_to(root).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = (str(path), path.read_bytes().decode())
    return found, {}


def plan() -> dict[str, tuple[str, str]]:
    """Map each module to its path and text, as the plan has read them."""
    return kept()[0]


def changed(path: Path) -> int:
    """Return when a file or its attributes last changed, ns, which no program can set; or 0."""
    return path.stat().st_ctime_ns if path.is_file() else 0


def noted(path: Path) -> Path:
    """Return ``path``, a file that the plan is about to read, and note when it was `changed`."""
    kept()[1].setdefault(str(path), changed(path))
    return path


def refused(paths: Iterable[str]) -> list[str]:
    """Return a message for each file in ``paths`` that was edited after the run was planned."""
    known = kept()[1] if KEPT in os.environ else {}
    edited = [p for p in map(Path, paths) if known and known[str(p)] != changed(p)]
    return [f"{p}: edited during the run; run the same command again" for p in edited]


class _Planned(SourceFileLoader):
    """Finder and loader of planned modules; stores compiled code by their text, not their date."""

    @classmethod
    def find_spec(cls, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        file, _ = plan().get(name, ("", ""))
        return spec_from_file_location(name, file, loader=cls(name, file)) if file else None

    def get_data(self, path: str) -> bytes:
        for file, text in plan().values():
            if file == path:
                return text.encode()
        return super().get_data(path)

    def get_code(self, fullname: str) -> Any:
        text = self.get_data(self.path)
        key = hashlib.sha256(f"{sys.version} {self.path} ".encode() + text).digest()
        place = str(Path(os.environ[KEPT]).with_name("compiled") / fullname)
        with suppress(OSError, EOFError, ValueError, TypeError):
            held = self.get_data(place)
            if held.startswith(key):
                return marshal.loads(held[len(key) :])
        code = self.source_to_code(text, self.path)
        self.set_data(place, key + marshal.dumps(code))
        return code


def import_planned() -> None:
    """Import modules as planned from now on, if a run has started this process."""
    if KEPT in os.environ and _Planned not in sys.meta_path:
        sys.meta_path.insert(0, _Planned)


if __name__ == "__main__":
    import_planned()
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
