"""Import the code that a run has planned, whatever happens to its files while the run is at work.

A run keeps the texts that its plan has read in a file, and its jobs import modules from there
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
# File in which a run keeps its plan; environment variable with its path, for the jobs of the run.
PLAN, KEPT = Path(".snakemake/plan.json"), "PDROM_PLAN"


@cache
def kept() -> tuple[dict[str, tuple[str, str]], dict[str, int]]:
    """Return what the plan has read: module -> path and text, and other file -> `changed`."""
    if place := os.environ.get(KEPT):
        return tuple(json.loads(Path(place).read_bytes()))
    root, found = Path(__file__).resolve().parents[2], {}
    for path in sorted(path for name in PACKAGES for path in (root / name).rglob("*.py")):
        if path.is_file():  # an editor's lock file may be a link that leads nowhere
            name = ".".join(path.relative_to(root).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = (str(path), path.read_bytes().decode())
    return found, {}


def plan() -> dict[str, tuple[str, str]]:
    """Map each module to its path and text, as the plan has read them."""
    return kept()[0]


def changed(path: Path) -> int:
    """Time of the last change of a file or its attributes, ns, which no program can set; or 0."""
    return path.stat().st_ctime_ns if path.is_file() else 0


def noted(path: Path) -> Path:
    """Return ``path`` of a file that the plan reads next; the plan notes when it was `changed`."""
    kept()[1].setdefault(str(path), changed(path))
    return path


def refused(paths: Iterable[str]) -> list[str]:
    """Message for each of the files ``paths`` that was edited since the plan of the run."""
    known = kept()[1] if KEPT in os.environ else {}
    edited = [p for p in map(Path, paths) if known and known[str(p)] != changed(p)]
    return [f"{p}: edited while the run was at work; run the same command again" for p in edited]


class _Planned(SourceFileLoader):
    """Finder and loader of planned modules; compiled code is kept by their text, not by date."""

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
