"""``pdrom cost SCENE.yaml``: compare settings of a scene by error and time."""

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
            raise ConfigurationError(f"--plot {out}: only PNG is written; end the name in .png")
        require_output(out, [arguments.scene, *arguments.coarser, *arguments.model], scene)
    table = cost(scene, arguments.coarser, arguments.model, Progress)
    sys.stdout.write(f"{shown(table, scene.config.frames)}\n")
    if out:
        with atomic_path(out, with_checksum=False) as temporary:
            mark = {"Software": MARK.decode()}
            plot_cost(table).savefig(temporary, format="png", dpi=150, metadata=mark)
        sys.stdout.write(f"{out}: plot of position error against time\n")
    return Status.DONE


def shown(table: "pd.DataFrame", frames: int) -> str:
    """Format the ``table`` of `pdrom.api.cost` for a scene of ``frames`` frames, with notes."""
    marked = table.best.map({True: "* ", False: "  "}) + table.setting
    width = marked.str.len().max()
    columns = {"  setting".ljust(width): marked.str.ljust(width)}
    for name in ("position_error", "deformation_error"):
        columns[name.replace("_", " ")] = table[name].map(lambda e: ERROR.get(str(e), f"{e:.2g}"))
    columns["ms a frame"] = table.ms.map("{:.3g}".format)
    busy, error = table.attrs["busy"], table.attrs["mesh_error"]
    lines = [
        table.assign(**columns)[[*columns]].to_string(index=False),
        "* no other setting has both a smaller position error and a shorter time",
        f"errors: relative to converged time steps, over {frames} frames; times: of the first "
        f"{table.attrs['frames']} frames{', unreliable: other programs ran' * busy}",
    ]
    if error is not None:
        what = f"estimated position error that is due to the mesh: {error:.2g}"
        lines.append(f"{what}; smaller errors are not closer to the real body")
    return "\n".join(lines)


COMMAND = Command(
    "Compare error and time of iterations, coarser meshes and reduced models of a scene",
    "pdrom cost bar.yaml --coarser coarse.msh --model bar.model.h5 --plot cost.png",
    {
        "scene": SCENE,
        "--coarser": text("MESH", "coarser mesh files (default: grids)", nargs="+", default=[]),
        "--model": text("MODEL", "reduced models from pdrom train", nargs="+", default=[]),
        "--plot": text("FILE", "plot error against time (.png)"),
    },
    perform,
)
