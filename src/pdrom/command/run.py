"""``pdrom run SCENE.yaml``: a full-order run."""

import argparse
import sys
from pathlib import Path

from pdrom.command.base import SCENE, Command, Status, files_of, require_output


def perform(arguments: argparse.Namespace) -> Status:
    """Run the scene of ``arguments`` with a progress line, and print the path of the result."""
    import numpy as np

    from pdrom.api import load_scene, run
    from pdrom.command.progress import Progress
    from pdrom.model.mesh.checks import seams

    file = Path(arguments.scene)
    out = arguments.out or str(file.parent / f"{file.stem}.h5")
    scene = load_scene(arguments.scene)
    require_output(out, files_of(arguments.scene, scene))
    full = run(scene, out, Progress(scene.config.name, scene.config.frames))
    sys.stdout.write(
        f"{out}: {scene.config.frames} frames of {scene.mesh.vertices} vertices "
        f"({seams(scene.mesh)}), {np.median(full.ms):.2f} ms a frame (median)\n"
    )
    return Status.DONE


COMMAND = Command(
    "Run a scene in full order",
    "pdrom run sheet.yaml --out sheet.h5",
    {
        "scene": SCENE,
        "--out": {
            "metavar": "FILE",
            "help": "file to write (HDF5); SCENE.h5 beside the scene without it",
        },
    },
    perform,
)
