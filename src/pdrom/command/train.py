"""``pdrom train SCENE.yaml``: train a reduced model and print its validation."""

import argparse
import sys
from pathlib import Path

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, flag, number, require_output, text
from pdrom.core.errors import StorageError


def perform(arguments: argparse.Namespace) -> Status:
    """Train a model on runs of a scene, save it, and print its validation and training time."""
    from pdrom.api import load, load_scene, run, train
    from pdrom.api.training import arguments as check
    from pdrom.command.progress import Progress

    file = Path(arguments.scene)
    out, scene = arguments.out or str(file.parent / f"{file.stem}.model.h5"), load_scene(file)
    require_output(out, [arguments.scene, *arguments.runs], scene)
    keys = ("modes", "tolerance", "skinning", "hold", "variations", "validate", "error")
    given = {key: getattr(arguments, key) for key in (*keys, "group", "method", "r")}
    given |= {"converged": not arguments.unconverged, "progress": Progress}
    check(scene, given | {"others": arguments.runs[1:]})
    runs = [load(path, arguments.unchecked) for path in arguments.runs]
    if runs and runs[0].scene.config != scene.config:
        raise StorageError(f"{arguments.runs[0]}: not a run of {arguments.scene}; run it again")
    before = 0.0
    if not runs:
        runs = [run(scene, on_frame=Progress(scene.config.name, scene.config.frames))]
        before = 1e-3 * runs[0].ms.sum()
    model = train(*runs, **given)
    model.save(out)
    sys.stdout.write(f"{model.validation.to_string(index=False, float_format='%.3g')}\n")
    first, seconds = model.validation.iloc[0], before + model.training.seconds
    saved = first.ms * (first.speedup - 1.0)  # ms per frame
    paid = f"as long as the model saves in {1e3 * seconds / saved:.0f} frames"
    sys.stdout.write(
        f"{out}: {model.title}; training took {seconds:.3g} s, "
        f"{paid if saved > 0.0 else 'but the model is not faster than the full-order model'}"
        f"{' (times are unreliable: other programs ran)' * bool(model.validation.busy.any())}\n"
    )
    return Status.DONE


COMMAND = Command(
    "Train a reduced model on runs of a mesh, and validate it",
    "pdrom train bar.yaml --modes 40 --variations 3 --validate 2",
    {
        "scene": SCENE,
        "runs": text("RUN.h5", "full-order runs, first of SCENE (default: a new run)", nargs="*"),
        "--modes": number(40, "number of POD modes of the displacements"),
        "--tolerance": number(0.01, "relative tolerance of the element sampling"),
        "--skinning": number(0, "number of skinning columns added to the modes"),
        "--hold": text("SIDE", "sides that later scenes may fix, too", nargs="+", default=()),
        "--variations": number(0, "number of random variations of the scene to train on"),
        "--validate": number(0, "number of other random variations for validation"),
        "--error": number(None, "use the fewest of 20, 40, 80 modes that reach this error"),
        "--unconverged": flag("do not solve the training frames to convergence"),
        "--method": text("M", "reduce projections instead of positions, by this method"),
        "--group": text("G", "group whose projections are reduced (required if several exist)"),
        "--r": number(20, "number of modes with --method or --group"),
        "--out": text("FILE", "HDF5 file to write (default: SCENE.model.h5)"),
        "--unchecked": UNCHECKED,
    },
    perform,
)
