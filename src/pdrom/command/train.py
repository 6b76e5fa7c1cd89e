"""``pdrom train SCENE.yaml``: a reduced model, with the table of its validation."""

import argparse
import sys
from pathlib import Path

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, flag, number, require_output, text
from pdrom.core.errors import StorageError


def perform(arguments: argparse.Namespace) -> Status:
    """Train a model on the run of a scene and on further runs; print it with its validation."""
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
        raise StorageError(f"{arguments.runs[0]}: a run of another scene than {arguments.scene}")
    before = 0.0
    if not runs:
        runs = [run(scene, on_frame=Progress(scene.config.name, scene.config.frames))]
        before = 1e-3 * runs[0].ms.sum()
    model = train(*runs, **given)
    model.save(out)
    sys.stdout.write(f"{model.validation.to_string(index=False, float_format='%.3g')}\n")
    first, seconds = model.validation.iloc[0], before + model.training.seconds
    saved = first.ms * (first.speedup - 1.0)  # ms per frame
    paid = f"paid back after {1e3 * seconds / saved:.0f} frames"
    sys.stdout.write(
        f"{out}: {model.title}; training took {seconds:.3g} s, "
        f"{paid if saved > 0.0 else 'never paid back: the full order is at least as fast'}"
        f"{' (times are unreliable: other programs ran)' * bool(model.validation.busy.any())}\n"
    )
    return Status.DONE


COMMAND = Command(
    "Train a reduced model on runs of a mesh, and validate it",
    "pdrom train bar.yaml --modes 40 --variations 3 --validate 2",
    {
        "scene": SCENE,
        "runs": text("RUN.h5", "runs to train on, the first of SCENE (else made)", nargs="*"),
        "--modes": number(40, "POD modes of the displacements"),
        "--tolerance": number(0.01, "of the sampled elements"),
        "--skinning": number(0, "skinning columns beside the modes"),
        "--hold": text("SIDE", "sides that later scenes may hold, too", nargs="+", default=()),
        "--variations": number(0, "random variations to train on"),
        "--validate": number(0, "random variations to validate on"),
        "--error": number(None, "choose the smallest of 20, 40, 80 modes within this error"),
        "--unconverged": flag("train on frames of the scene's iterations, not on converged ones"),
        "--method": text("M", "reduce a group's projections by this one of config/methods.yaml"),
        "--group": text("G", "the group; needed if the scene has several"),
        "--r": number(20, "their modes"),
        "--out": text("FILE", "file to write (HDF5); SCENE.model.h5 without it"),
        "--unchecked": UNCHECKED,
    },
    perform,
)
