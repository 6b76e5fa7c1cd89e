"""``pdrom cost SCENE.yaml``: settings of a scene, each with its error and its time."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import SCENE, Command, Status, require_output, text
from pdrom.core.errors import ConfigurationError

if TYPE_CHECKING:
    import pandas as pd

ERROR = {"nan": "-", "inf": "blew up"}


def perform(arguments: argparse.Namespace) -> Status:
    """Print the table of settings of the scene of ``arguments``, and draw it."""
    from pdrom.api import cost, load_scene
    from pdrom.api.pictures import plot_cost
    from pdrom.command.progress import Progress
    from pdrom.core.store import MARK, atomic_path

    scene, out = load_scene(arguments.scene), arguments.plot
    if out:
        if Path(out).suffix.lower() != ".png":
            raise ConfigurationError(f"--plot {out}: the name of a picture ends in .png")
        require_output(out, [arguments.scene, *arguments.coarser, *arguments.model], scene)
    table = cost(scene, arguments.coarser, arguments.model, Progress)
    sys.stdout.write(f"{shown(table, scene.config.frames)}\n")
    if out:
        with atomic_path(out, with_checksum=False) as temporary:
            mark = {"Software": MARK.decode()}
            plot_cost(table).savefig(temporary, format="png", dpi=150, metadata=mark)
        sys.stdout.write(f"{out}: position error against time\n")
    return Status.DONE


def shown(table: "pd.DataFrame", frames: int) -> str:
    """Lines of a ``table`` by `pdrom.api.cost` of a scene with ``frames``, and what they mean."""
    marked = table.best.map({True: "* ", False: "  "}) + table.setting
    width = marked.str.len().max()
    columns = {"  setting".ljust(width): marked.str.ljust(width)}
    for name in ("position_error", "deformation_error"):
        columns[name.replace("_", " ")] = table[name].map(lambda e: ERROR.get(str(e), f"{e:.2g}"))
    columns["ms a frame"] = table.ms.map("{:.3g}".format)
    busy, error = table.attrs["busy"], table.attrs["mesh_error"]
    lines = [
        table.assign(**columns)[[*columns]].to_string(index=False),
        "* no other setting is as good in position error and time, and better in one of them",
        f"errors against the converged step over {frames} frames; times of the first "
        f"{table.attrs['frames']} frames{', unreliable: other programs ran' * busy}",
    ]
    if error is not None:
        what = f"estimated position error of the mesh itself: {error:.2g}"
        lines.append(f"{what}; a setting with a smaller error is no nearer to the body")
    return "\n".join(lines)


COMMAND = Command(
    "Compare what iterations, coarser meshes and models of a scene cost, and their errors",
    "pdrom cost bar.yaml --coarser coarse.msh --model bar.model.h5 --plot cost.png",
    {
        "scene": SCENE,
        "--coarser": text("MESH", "coarser meshes (else grids are made)", nargs="+", default=[]),
        "--model": text("MODEL", "files by pdrom train, of its mesh", nargs="+", default=[]),
        "--plot": text("FILE", "picture of error against time (.png)"),
    },
    perform,
)
