"""``pdrom draw RESULT ...``: pictures, films, tables and files for ParaView of a scene's runs."""

import argparse
import sys
from pathlib import Path

from pdrom.command.base import Command, Status
from pdrom.command.results import declare_results, files_of, viewed
from pdrom.core.paths import RESULTS
from pdrom.core.project import checkout


def declare(parser: argparse.ArgumentParser) -> None:
    """Add to ``parser`` the runs, what is made of them, and where."""
    declare_results(parser)
    parser.add_argument(
        "--as", dest="kinds", metavar="KIND", nargs="+", default=[],
        help="frames, error_against_r, error_against_time, runs (these without the option), "
        "animation, gif, vtk, viewer, advice",
    )  # fmt: skip
    parser.add_argument(
        "--out", metavar="FOLDER",
        help="folder in which each scene gets one of its name; without it that of the first file, "
        "or results/scenes",
    )  # fmt: skip


def perform(arguments: argparse.Namespace) -> Status:
    """Write the files that ``arguments`` ask for and say where they are."""
    from pdrom.core.store import require_place
    from pdrom.report.scenes.kinds import draw, require_kinds

    kinds = require_kinds(arguments.kinds, "--as")
    folder = Path(arguments.out) if arguments.out else _folder(arguments.results)
    require_place(folder / "scene")
    for scene in viewed(arguments):
        for kind in kinds:
            files = draw(scene, kind, folder / scene.name)
            sys.stdout.write(f"{kind}: {', '.join(map(str, files))}\n")
    return Status.DONE


def _folder(results: list[str]) -> Path:
    files = files_of(results)
    return Path(files[0]).parent if files else (checkout() or Path()) / RESULTS / "scenes"


COMMAND = Command(
    "Draw runs: frames, errors, a table; films, files for ParaView, a page",
    "pdrom draw sheet_spring_gappy_20.h5 --as frames animation vtk",
    declare,
    perform,
)
