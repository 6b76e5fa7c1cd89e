"""``pdrom cost SCENE.yaml``: settings of a scene, each with its error and its time."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import SCENE, Command, Status, files_of, require_output

if TYPE_CHECKING:
    import pandas as pd

HEADS = ("  setting", "position error", "deformation error", "ms a frame")


def perform(arguments: argparse.Namespace) -> Status:
    """Print the table of settings of the scene of ``arguments``, and draw it."""
    from pdrom.api import cost, load_scene
    from pdrom.api.pictures import plot_cost
    from pdrom.command.progress import Progress
    from pdrom.core.errors import ConfigurationError
    from pdrom.view.frames import write_png

    scene, out = load_scene(arguments.scene), arguments.plot
    if out:
        if Path(out).suffix.lower() != ".png":
            raise ConfigurationError(f"--plot {out}: the name of a picture ends in .png")
        require_output(
            out, [*files_of(arguments.scene, scene), *arguments.coarser, *arguments.model]
        )
    table = cost(scene, arguments.coarser, arguments.model, Progress)
    sys.stdout.write(f"{shown(table, scene.config.frames)}\n")
    if out:
        write_png(plot_cost(table), Path(out))
        sys.stdout.write(f"{out}: position error against time\n")
    return Status.DONE


def shown(table: "pd.DataFrame", frames: int) -> str:
    """Lines of a ``table`` by `pdrom.api.cost` of a scene with ``frames``, and what they mean."""
    rows = [
        (f"{' *'[row.best]} {row.setting}", _error(row.position_error),
         _error(row.deformation_error), f"{row.ms:.3g}")
        for row in table.itertuples()
    ]  # fmt: skip
    first, *widths = (max(map(len, column)) for column in zip(HEADS, *rows, strict=True))
    lines = [
        "  ".join([f"{name:<{first}}", *(f"{v:>{w}}" for v, w in zip(values, widths, strict=True))])
        for name, *values in (HEADS, *rows)
    ]
    lines += [
        "* no other setting is as good in position error and time, and better in one of them",
        f"errors against the converged step over {frames} frames; "
        f"times of the first {table.attrs['frames']} frames"
        f"{', unreliable: other programs ran' * table.attrs['busy']}",
    ]
    if (error := table.attrs["mesh_error"]) is not None:
        lines.append(
            f"estimated position error of the mesh itself: {error:.2g}; a setting with a smaller "
            "error is no nearer to the body"
        )
    return "\n".join(lines)


def _error(value: float) -> str:
    return {"nan": "-", "inf": "blew up"}.get(str(value), f"{value:.2g}")


COMMAND = Command(
    "Compare what iterations, coarser meshes and models of a scene cost, and their errors",
    "pdrom cost bar.yaml --coarser coarse.msh --model bar.model.h5 --plot cost.png",
    {
        "scene": SCENE,
        "--coarser": {
            "metavar": "MESH",
            "nargs": "+",
            "default": [],
            "help": "files of coarser meshes, read as the scene's own; grids are made if left out",
        },
        "--model": {
            "metavar": "MODEL.h5",
            "nargs": "+",
            "default": [],
            "help": "files by pdrom train, of the scene's mesh",
        },
        "--plot": {"metavar": "FILE.png", "help": "picture of error against time"},
    },
    perform,
)
