"""``pdrom reduce SCENE.yaml``: run with one constraint group reduced, or within an error limit."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, files_of, require_output

if TYPE_CHECKING:
    from pdrom.api import ReducedRun, RequestedRun
    from pdrom.model.scene import Scene

WRONG = 0.1  # relative error above which the command calls a run "wrong" instead of "accurate"
# File format of a picture -> key of its metadata that names the program which made it.
PICTURES = {"pdf": "Creator", "png": "Software", "svg": "Creator"}


def _size(text: str) -> int:
    size = int(text)
    if size < 1:
        raise argparse.ArgumentTypeError(f"{size}: a number of modes is required, at least 1")
    return size


def perform(arguments: argparse.Namespace) -> Status:
    """Run the scene reduced in one group or within an error limit; print the run's error and time.

    With a group, the full-order run is computed first, unless a file of it is given.
    """
    if arguments.group is None:
        return _perform_request(arguments)
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

    from pdrom.reduction.rerun import displacement_norms

    gain = f"gain {reduced.gain:.3g} (how much sampling may amplify what the basis misses)"
    if not reduced.outcome.finite:
        return f"{reduced.title}: blew up at frame {reduced.outcome.blowup_frame} ({gain})"
    speed = f"{reduced.ms:.2f} ms a frame (full order {np.median(reduced.full.ms):.2f})"
    error = reduced.outcome.error(displacement_norms(reduced.full.positions))
    if error is None:
        return f"{reduced.title}: no error: nothing moves, {gain}, {speed}"
    largest, verdict = float(reduced.error.max()), "accurate" if error <= WRONG else "wrong"
    return (
        f"{reduced.title}: relative error {error:.2g} of the full order's motion, over all frames "
        f"(largest of one frame {largest:.2g}; {verdict}: {WRONG:g} is the limit), {gain}, {speed}"
    )


def _perform_request(arguments: argparse.Namespace) -> Status:
    """Find the cheapest solver within the error limit in a training run; run the scene with it."""
    from pdrom.api import FullRun, load, load_scene, reduce, save
    from pdrom.command.progress import LevelProgress
    from pdrom.core.errors import ConfigurationError, StorageError
    from pdrom.reduction.requested.run import read_request

    scene = load_scene(arguments.scene)
    wish, source = arguments.error, "--error"
    if wish is None:
        wish, source = scene.config.requested_error, f"{arguments.scene}: reduce.error"
    if wish is None:
        raise ConfigurationError(
            "--group or --error: one is required (or reduce.error in the scene)"
        )
    request = read_request(wish, source)
    if arguments.plot is not None:
        raise ConfigurationError("--plot: only together with --group")
    if not arguments.run:
        raise ConfigurationError(
            f"{source}: --run is required with it: a training run, which pdrom run makes"
        )
    stem = Path(arguments.scene).stem
    out = arguments.out or str(Path(arguments.scene).with_name(f"{stem}_requested.h5"))
    require_output(out, [*files_of(arguments.scene, scene), arguments.run])
    full = load(arguments.run, arguments.unchecked)
    if not isinstance(full, FullRun):
        raise StorageError(f"{arguments.run}: no full-order run (pdrom run makes one)")
    with LevelProgress(scene.config.name) as progress:
        made = reduce(full, error=request, scene=scene, on_frame=progress)
    save(made, out)
    sys.stdout.write("\n".join([f"{out}: {_answer(made)}", *_done(made)]) + "\n")
    enough = 2 * made.outcome.frames >= len(made.ms)
    return Status.DONE if enough else Status.NOTHING_FITS


def _answer(made: "RequestedRun") -> str:
    import numpy as np

    outcome, frames = made.outcome, len(made.ms)
    wish = f"{made.request} against the converged implicit step"
    if not np.isfinite(outcome.positions).all():
        return f"{wish}: blew up, with the full order, too"
    if not outcome.met:
        why = outcome.limit or "nothing meets it for sure"
        return f"{wish}: refused ({why}); run in full order with the most iterations"
    maker = "by a reduction" if outcome.reduced else "by the full order only"
    part = "" if outcome.frames == frames else f" up to frame {outcome.frames} of {frames}"
    return f"{wish}: met{part}, {maker}" + (f" ({outcome.limit})" if part else "")


def _done(made: "RequestedRun") -> list[str]:
    """Lines of text about the run ``made``: solver in use, estimated error and time."""
    outcome, ms = made.outcome, made.ms[0]
    tried = f", after {', '.join(outcome.failed)}" if outcome.failed else ""
    known = [f"expected at most {outcome.expected:.2g}"]
    if outcome.estimate is not None:
        known.append(f"estimated {outcome.estimate:.2g}")
    if made.error is not None:
        known.append(f"reached {made.error:.2g}")
    return [
        f"  by {outcome.level}{tried}; {len(outcome.checks)} frames checked",
        f"  error: {', '.join(known)}",
        f"  {ms:.2f} ms a frame, {outcome.full_ms:.2f} in the cheapest full order that meets it; "
        f"choosing took {made.offline_s:.1f} s, as long as {1e3 * made.offline_s / ms:.0f} frames",
    ]


COMMAND = Command(
    "Run a scene with the projections of one group reduced, and compare it with the full order",
    "pdrom reduce sheet.yaml --group spring --method gappy --r 20 --plot error.png",
    {
        "scene": SCENE,
        "--group": {"metavar": "G", "help": "constraint group to reduce"},
        "--error": {
            "metavar": "E",
            "help": "largest relative error of the run, 0.01 or velocity=0.05: the whole scene is "
            "reduced as far as that allows, or not at all (reduce.error of the scene)",
        },
        "--method": {
            "metavar": "M",
            "default": "gappy",
            "help": "name in config/methods.yaml (gappy)",
        },
        "--r": {"metavar": "R", "type": _size, "default": 20, "help": "number of modes (20)"},
        "--run": {
            "metavar": "FILE",
            "help": "full-order run by pdrom run; made first if it is left out, required with "
            "--error, where it may be of another motion of the same mesh",
        },
        "--out": {"metavar": "FILE", "help": "file to write (HDF5); SCENE_G_M_R.h5 without it"},
        "--plot": {"metavar": "FILE", "help": "picture of the error against time to write"},
        "--unchecked": UNCHECKED,
    },
    perform,
    one_of=("--group", "--error"),
)
