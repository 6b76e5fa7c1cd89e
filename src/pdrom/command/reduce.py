"""``pdrom reduce SCENE.yaml``: a run with one constraint group reduced."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, files_of, require_output

if TYPE_CHECKING:
    from pdrom.api import ReducedRun
    from pdrom.model.scene import Scene

WRONG = 0.1  # relative error above which the command calls a run "wrong" instead of "accurate"
# File format of a picture -> key of its metadata that names the program which made it.
PICTURES = {"pdf": "Creator", "png": "Software", "svg": "Creator"}


def _gone(_: str) -> NoReturn:
    """Refuse the option ``--error`` of earlier versions."""
    from pdrom.core.errors import ConfigurationError
    from pdrom.model.scene import GONE

    raise ConfigurationError(f"--error: {GONE}")


def _size(text: str) -> int:
    size = int(text)
    if size < 1:
        raise argparse.ArgumentTypeError(f"{size}: a number of modes is required, at least 1")
    return size


def perform(arguments: argparse.Namespace) -> Status:
    """Run the scene with one group reduced; print the error and the time of the run.

    The full-order run is computed first, unless a file of it is given.
    """
    from pdrom.api import FullRun, load, load_scene, plot, reduce, run, save
    from pdrom.command.progress import Progress
    from pdrom.core.errors import StorageError
    from pdrom.core.store import MARK, atomic_path

    file = Path(arguments.scene)
    name = f"{file.stem}_{arguments.group}_{arguments.method}_{arguments.r}.h5"
    out, scene = arguments.out or str(file.parent / name), load_scene(file)
    _check_outputs(arguments, out, scene)
    scene.group(arguments.group)
    if arguments.run:
        full = load(arguments.run, arguments.unchecked)
        if not isinstance(full, FullRun):
            raise StorageError(f"{arguments.run}: no full-order run (pdrom run makes one)")
        if full.scene.config != scene.config:
            raise StorageError(f"{arguments.run}: a run of another scene than {arguments.scene}")
    else:
        full = run(scene, on_frame=Progress(scene.config.name, scene.config.frames))
    reduced = reduce(full, arguments.group, arguments.method, r=arguments.r)
    save(reduced, out)
    if arguments.plot:
        picture = plot(reduced)
        with atomic_path(arguments.plot, with_checksum=False) as path:
            maker = PICTURES[path.suffix.lower().removeprefix(".")]
            picture.savefig(path, dpi=200, metadata={maker: MARK.decode()})
    sys.stdout.write(f"{out}: {_told(reduced)}\n")
    return Status.DONE if reduced.outcome.finite else Status.BLEW_UP


def _check_outputs(arguments: argparse.Namespace, out: str, scene: "Scene") -> None:
    """Raise StorageError or ConfigurationError if ``out`` or the picture cannot be written."""
    from pdrom.core.errors import ConfigurationError, choices

    read = [*files_of(arguments.scene, scene), *([arguments.run] if arguments.run else [])]
    require_output(out, read)
    if arguments.plot is None:
        return
    kind = Path(arguments.plot).suffix.lower().removeprefix(".")
    if kind not in PICTURES:
        raise ConfigurationError(
            f"--plot {arguments.plot}: no kind of picture '{kind}'{choices(kind, PICTURES)}"
        )
    require_output(arguments.plot, [*read, out])


def _told(reduced: "ReducedRun") -> str:
    import numpy as np

    from pdrom.model.metrics import trajectory_error
    from pdrom.reduction.rerun import displacement_norms

    gain = f"gain {reduced.gain:.3g} (how much sampling may amplify what the basis misses)"
    if not reduced.outcome.finite:
        return f"{reduced.title}: blew up at frame {reduced.outcome.blowup_frame} ({gain})"
    speed = f"{reduced.ms:.2f} ms a frame (full order {np.median(reduced.full.ms):.2f})"
    moved = displacement_norms(reduced.full.positions)
    error = trajectory_error(reduced.outcome.difference, moved)
    if error is None:
        return f"{reduced.title}: no error: nothing moves, {gain}, {speed}"
    largest, verdict = float(reduced.error.max()), "accurate" if error <= WRONG else "wrong"
    return (
        f"{reduced.title}: relative error {error:.2g} of the full order's motion, over all frames "
        f"(largest of one frame {largest:.2g}; {verdict}: {WRONG:g} is the limit), {gain}, {speed}"
    )


COMMAND = Command(
    "Run a scene with the projections of one group reduced, and compare it with the full order",
    "pdrom reduce sheet.yaml --group spring --method gappy --r 20 --plot error.png",
    {
        "scene": SCENE,
        "--group": {"metavar": "G", "required": True, "help": "constraint group to reduce"},
        "--error": {"type": _gone, "nargs": "?", "const": "", "help": argparse.SUPPRESS},
        "--method": {
            "metavar": "M",
            "default": "gappy",
            "help": "name in config/methods.yaml (gappy)",
        },
        "--r": {"metavar": "R", "type": _size, "default": 20, "help": "number of modes (20)"},
        "--run": {
            "metavar": "FILE",
            "help": "full-order run by pdrom run; made first if it is left out",
        },
        "--out": {"metavar": "FILE", "help": "file to write (HDF5); SCENE_G_M_R.h5 without it"},
        "--plot": {"metavar": "FILE", "help": "picture of the error against time to write"},
        "--unchecked": UNCHECKED,
    },
    perform,
)
