"""``pdrom train SCENE.yaml``: a reduced model, with the table of its validation."""

import argparse
import sys
from pathlib import Path

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, files_of, require_output


def perform(arguments: argparse.Namespace) -> Status:
    """Train a model on the run of a scene and on further runs; print it with its validation."""
    from pdrom.api import load, load_scene, run, train
    from pdrom.api.training import arguments as check
    from pdrom.command.progress import Progress
    from pdrom.core.errors import StorageError

    file = Path(arguments.scene)
    out, scene = arguments.out or str(file.parent / f"{file.stem}.model.h5"), load_scene(file)
    require_output(out, [*files_of(arguments.scene, scene), *arguments.runs])
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
        "runs": {
            "metavar": "RUN.h5",
            "nargs": "*",
            "help": "runs to train on, the first of this scene; made if left out",
        },
        "--modes": {"type": int, "default": 40, "help": "POD modes of the displacements (40)"},
        "--tolerance": {"type": float, "default": 0.01, "help": "of the sampled elements (0.01)"},
        "--skinning": {"type": int, "default": 0, "help": "skinning columns beside the modes (0)"},
        "--hold": {
            "metavar": "SIDE",
            "nargs": "+",
            "default": (),
            "help": "sides that later scenes may hold, beside those that the scene holds",
        },
        "--variations": {"type": int, "default": 0, "help": "random variations to train on (0)"},
        "--validate": {"type": int, "default": 0, "help": "random variations to validate on (0)"},
        "--error": {
            "type": float,
            "help": "choose the smallest of 20, 40, 80 modes within this error in validation",
        },
        "--unconverged": {
            "action": "store_true",
            "help": "train on frames of the scene's iterations instead of converged ones",
        },
        "--method": {
            "metavar": "M",
            "help": "reduce the projections of a group instead, by a method of config/methods.yaml",
        },
        "--group": {"metavar": "G", "help": "the group; needed if the scene has several"},
        "--r": {"metavar": "R", "type": int, "default": 20, "help": "their modes (20)"},
        "--out": {"metavar": "FILE", "help": "file to write (HDF5); SCENE.model.h5 without it"},
        "--unchecked": UNCHECKED,
    },
    perform,
)
