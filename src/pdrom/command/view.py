"""``pdrom view RESULT ...``: show runs, or a running model, in an HTML page or other files."""

import argparse
import sys
import webbrowser
from pathlib import Path

from pdrom.command.base import UNCHECKED, Command, Status, flag, require_output, text
from pdrom.core.errors import ConfigurationError


def perform(arguments: argparse.Namespace) -> Status:
    """Write the page, picture or ParaView files of the runs in ``arguments``; print their paths."""
    from pdrom.api import load, load_model
    from pdrom.api.pictures import viewed_scenes
    from pdrom.view.frames import FRAMES, vtk, write_frames
    from pdrom.view.page import write_page

    first = Path(arguments.runs[0])
    out = Path(arguments.out or first.parent / f"{first.stem}.html")
    require_output(out, arguments.runs)
    written = [arguments.png] if arguments.png else []
    if arguments.vtk:
        written += [Path(arguments.vtk, "run.pvd"), *Path(arguments.vtk).glob(FRAMES)]
    for path in written:
        require_output(path, [*arguments.runs, str(out)])
    if arguments.live and (written or len(arguments.runs) > 2):
        raise ConfigurationError("--live: only a model and one run, without --png and --vtk")
    model = load_model(first) if arguments.live else None
    runs = [load(file, arguments.unchecked) for file in arguments.runs[bool(model) :]]
    scenes = [] if model else viewed_scenes(*runs)
    if len(scenes) > 1 and written:
        raise ConfigurationError("--png and --vtk: only for runs of one scene")
    if model:
        model.view(out, *runs)
    else:
        write_page(scenes, out)
    size = out.stat().st_size / 1e6
    sys.stdout.write(f"{out}: {size:.1f} MB; opens in a browser without a network\n")
    if arguments.png:
        write_frames(scenes[0], Path(arguments.png))
        sys.stdout.write(f"{arguments.png}: four frames of each run\n")
    if arguments.vtk:
        vtk(scenes[0], Path(arguments.vtk, "run.pvd"))
        sys.stdout.write(f"{Path(arguments.vtk, 'run.pvd')}: open it in ParaView\n")
    if arguments.open and not webbrowser.open(out.resolve().as_uri()):
        sys.stderr.write("pdrom: no browser was found; open the file by hand\n")
    return Status.DONE


COMMAND = Command(
    "Show runs, or a model that runs in the browser, as a page, a picture or files for ParaView",
    "pdrom view pulled_sheet.h5 pulled.h5 --open",
    {
        "runs": text("RESULT", "runs (with --live: a model and at most one run)", nargs="+"),
        "--live": flag("let the page run the model, with the run as wires"),
        "--out": text("FILE", "page to write (default: the first RESULT, as .html)"),
        "--open": flag("open the page in the browser"),
        "--png": text("FILE", "also draw four frames of each run"),
        "--vtk": text("FOLDER", "also write files for ParaView: one per frame, and run.pvd"),
        "--unchecked": UNCHECKED,
    },
    perform,
)
