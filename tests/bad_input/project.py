"""A small valid project that a test breaks in one place."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pdrom.core.yamlfile import read_yaml
from places import CONFIG, ROOT
from study.pipeline.commandline import check_files
from study.pipeline.plan import Plan
from study.pipeline.study import Study

STUDY = "config/default.yaml"
SCENE = "config/scenes/small.yaml"
MESH = "meshes/square.obj"  # as the scene's file names it

SMALL_SCENE = """\
name: small
title: A small sheet
mesh: {kind: cloth, rows: 5, columns: 4, plane: xz}
time_step: 0.016
frames: 8
effects:
  - {effect: gravity}
  - {effect: pins, select: left}
  - {effect: spring, weight: 1.0e+5}
reduce:
  spring: {train: 4}
held_out: {kick: 0.5}
"""
SMALL_STUDY = """\
scenes: [small]
methods: [pod, block-deim]
ranks: [2, full]
"""
SQUARE = """\
v 0 0 0
v 1 0 0
v 1 0 1
v 0 0 1
f 1 2 3
f 1 3 4
"""


class Replace(NamedTuple):
    """One text of a file in place of another."""

    old: str
    new: str


class LinkTo(NamedTuple):
    """A symbolic link in place of a file."""

    target: str


Content = str | bytes | Replace | LinkTo | None
"""New content of a file; None removes it."""


def with_mesh(entry: str) -> Replace:
    """Another mesh of the scene, as YAML."""
    return Replace("{kind: cloth, rows: 5, columns: 4, plane: xz}", entry)


def make_project(folder: Path, changes: Mapping[str, Content]) -> Path:
    """The small project in ``folder``, with ``changes`` (path -> content)."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(CONFIG, folder / "config", dirs_exist_ok=True)
    if not (folder / "paper").exists():
        (folder / "paper").symlink_to(ROOT / "paper")  # it numbers the figures
    files = {STUDY: SMALL_STUDY, SCENE: SMALL_SCENE, f"config/scenes/{MESH}": SQUARE}
    for path, content in [*files.items(), *changes.items()]:
        _write(folder / path, content)
    return folder


def _write(path: Path, content: Content) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, Replace):
        text = path.read_text(encoding="utf-8")
        assert content.old in text, f"{path} has no {content.old!r}"
        content = text.replace(content.old, content.new, 1)
    if isinstance(content, LinkTo):
        path.unlink(missing_ok=True)
        path.symlink_to(content.target)
    elif content is None:
        path.unlink(missing_ok=True)
    else:
        path.unlink(missing_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def load_project(root: Path, overrides: Mapping[str, Any] | None = None) -> Plan:
    """Plan the study as the workflow does; ``overrides`` stand for ``--config``."""
    check_files([root / STUDY])
    config = {**read_yaml(root / STUDY), **(overrides or {})}
    plan = Plan(Study(config, root))
    plan.check()
    return plan
