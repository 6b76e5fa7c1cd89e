"""Arguments that name runs: files of ``pdrom run`` and ``reduce``, or scenes of the pipeline."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import declare_unchecked
from pdrom.core.project import checkout

if TYPE_CHECKING:
    from pdrom.report.viewer.runs import ViewedScene


def declare_results(parser: argparse.ArgumentParser) -> None:
    """Add to ``parser`` the runs, and which configuration the pipeline made them with."""
    parser.add_argument(
        "results", metavar="RESULT", nargs="+",
        help="files of pdrom run and pdrom reduce, or names of scenes that ./reproduce has run",
    )  # fmt: skip
    parser.add_argument(
        "--configfile", nargs="+", default=[], metavar="FILE",
        help="of scenes: the configuration of ./reproduce, if it was another one",
    )  # fmt: skip
    parser.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE", help="likewise")
    declare_unchecked(parser)


def viewed(arguments: argparse.Namespace) -> "list[ViewedScene]":
    """Scenes with the runs that ``arguments`` name.

    Raises
    ------
    PdromError
        There is no such file or scene, or it has no results.
    """
    from pdrom.api import load
    from pdrom.api.pictures import viewed_scenes

    files = files_of(arguments.results)
    scenes = [name for name in arguments.results if name not in files]
    own = viewed_scenes(*(load(file, arguments.unchecked) for file in files)) if files else []
    return [*own, *(_of_pipeline(scenes, arguments) if scenes else ())]


def files_of(results: Sequence[str]) -> list[str]:
    """Arguments among ``results`` that are files."""
    return [name for name in results if _is_file(name)]


def _is_file(name: str) -> bool:
    """Whether an argument names a file, be it there or not: a scene's name is a plain word."""
    return not name.isidentifier() or Path(name).exists()


def _of_pipeline(scenes: list[str], arguments: argparse.Namespace) -> "list[ViewedScene]":
    from pdrom.core.errors import StorageError
    from pdrom.core.paths import TRAIN
    from pdrom.pipeline.commandline import options
    from pdrom.pipeline.folders import folders
    from pdrom.pipeline.scene_command import scene_results, study_of

    root, named = checkout() or Path(), (arguments.configfile, arguments.config)
    study, results = study_of(root, scenes, *named), str(root / folders(*named).results)
    for scene in scenes:
        if not Path(TRAIN.at(results, scene=scene)).exists():
            made = shlex.join(["./reproduce", "scene", scene, *options(*named)])
            raise StorageError(f"{scene}: {results} holds no run of it; {made} makes them")
    return [scene_results(study, scene, results).viewed() for scene in scenes]
