"""``pdrom reduce SCENE.yaml``: a run with the projections of one group reduced."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import Command, Status

if TYPE_CHECKING:
    from pdrom.api import ReducedRun


def _size(text: str) -> int:
    size = int(text)
    if size < 1:
        raise argparse.ArgumentTypeError(f"{size}: a number of modes is required, at least 1")
    return size


def declare(parser: argparse.ArgumentParser) -> None:
    """The scene, what is reduced and how, and the file to write."""
    parser.add_argument("scene", metavar="SCENE.yaml", help="file of the scene")
    parser.add_argument("--group", metavar="G", required=True, help="constraint group to reduce")
    parser.add_argument(
        "--method", metavar="M", default="gappy", help="name in config/methods.yaml (gappy)"
    )
    parser.add_argument("--r", metavar="R", type=_size, default=20, help="number of modes (20)")
    parser.add_argument(
        "--run", metavar="FILE", help="full-order run by pdrom run; it is made anew without it"
    )
    parser.add_argument(
        "--out", metavar="FILE", help="file to write (HDF5); SCENE_G_M_R.h5 without it"
    )
    parser.add_argument("--plot", metavar="FILE", help="picture of the error against time to write")


def perform(arguments: argparse.Namespace) -> Status:
    """Run in full order unless that is done, reduce, run again, and say how it went."""
    from pdrom.api import FullRun, load, load_scene, plot, reduce, run, save
    from pdrom.command.progress import Progress
    from pdrom.core.errors import StorageError
    from pdrom.core.store import atomic_path

    scene = load_scene(arguments.scene)
    scene.group(arguments.group)
    if arguments.run:
        full = load(arguments.run)
        if not isinstance(full, FullRun):
            raise StorageError(f"{arguments.run}: no full-order run (pdrom run makes one)")
        if full.scene.config != scene.config:
            raise StorageError(f"{arguments.run}: a run of another scene than {arguments.scene}")
    else:
        full = run(scene, on_frame=Progress(scene.config.name, scene.config.frames))
    reduced = reduce(full, arguments.group, arguments.method, arguments.r)
    out = arguments.out or _file(arguments)
    save(reduced, out)
    if arguments.plot:
        picture = plot(reduced)
        with atomic_path(arguments.plot) as path:
            picture.savefig(path, dpi=200)
    sys.stdout.write(f"{out}: {_told(reduced)}\n")
    return Status.DONE if reduced.outcome.finite else Status.BLEW_UP


def _file(arguments: argparse.Namespace) -> str:
    path = Path(arguments.scene)
    name = f"{path.stem}_{arguments.group}_{arguments.method}_{arguments.r}.h5"
    return str(path.with_name(name))


def _told(reduced: "ReducedRun") -> str:
    import numpy as np

    from pdrom.reduction.rerun import displacement_norms

    outcome, full = reduced.outcome, reduced.full
    if not outcome.finite:
        return f"{reduced.title}: blew up at frame {outcome.blowup_frame} (gain {reduced.gain:.3g})"
    error = outcome.error(displacement_norms(full.positions))
    told = "no error: nothing moves" if error is None else f"relative error {error:.2g}"
    return (
        f"{reduced.title}: {told}, gain {reduced.gain:.3g}, {reduced.ms:.2f} ms a frame "
        f"(full order {np.median(full.ms):.2f})"
    )


COMMAND = Command(
    "Run a scene with the projections of one group reduced, and compare it with the full order",
    "pdrom reduce sheet.yaml --group spring --method gappy --r 20 --plot error.png",
    declare,
    perform,
)
