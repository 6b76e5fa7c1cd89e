"""``pdrom run SCENE.yaml``: simulate a scene with the full-order or a reduced model."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import SCENE, UNCHECKED, Command, Status, flag, require_output, text
from pdrom.core.errors import ConfigurationError

if TYPE_CHECKING:
    from pdrom.api import Model, Run


def perform(arguments: argparse.Namespace) -> Status:
    """Run the scene of ``arguments`` with a progress line, and print the path of the result."""
    import numpy as np

    from pdrom.api import load, load_model, load_scene, run
    from pdrom.api.records import standstill
    from pdrom.api.runs import check
    from pdrom.command.progress import Progress
    from pdrom.model.mesh.checks import seams

    file, scene = Path(arguments.scene), load_scene(arguments.scene)
    part, whole = arguments.model, "only for full-order runs (without --model)"
    for wrong, fault in (
        (part and (arguments.start or arguments.frame is not None), f"--from, --frame: {whole}"),
        (arguments.compare and not part, "--compare: only for reduced runs (with --model)"),
        (arguments.check and (part or arguments.start), f"--check: {whole}, and without --from"),
        (arguments.no_estimate and part, f"--no-estimate: {whole}"),
    ):
        if wrong:
            raise ConfigurationError(fault)
    used = f"_{Path(part).stem.removesuffix('.model')}" if part else ""
    out = arguments.out or str(file.with_name(f"{file.stem}{used}.h5"))
    others = filter(None, (part, arguments.compare, arguments.start))
    require_output(out, [arguments.scene, *others], scene)
    model = load_model(part) if part else None
    reference = load(arguments.compare, arguments.unchecked) if arguments.compare else None
    if reference and not (reference.full_order and reference.scene.config == scene.config):
        fault = f"not a full-order run with the present keys of {file}; run it again"
        raise ConfigurationError(f"--compare {arguments.compare}: {fault}")
    tick = Progress(scene.config.name, scene.config.frames)
    start = load(arguments.start, arguments.unchecked) if arguments.start else None
    begin = start, arguments.frame, not arguments.no_estimate
    made = model.run(scene, out, tick) if model else run(scene, out, tick, *begin)
    sys.stdout.write(
        f"{out}: {len(made.ms)} frames of {scene.mesh.vertices} vertices ({seams(scene.mesh)}), "
        f"{np.median(made.ms):.2f} ms a frame (median)\n"
    )
    if made.blowup_frame is None and (still := standstill(scene, made.positions)):
        sys.stdout.write(f"{out}: {still}\n")
    if model and reference:
        sys.stdout.write(f"{_compared(model, made, reference)}\n")
    if arguments.check:
        sys.stdout.write(f"estimated error of the run: {check(made)}\n")
    if made.blowup_frame is not None:
        sys.stdout.write(f"{out}: blew up in frame {made.blowup_frame}\n")
        return Status.BLEW_UP
    return Status.DONE


def _compared(model: "Model", made: "Run", reference: "Run") -> str:
    speed = model.speed(made.scene)
    busy = "; unreliable: other programs ran" if speed["busy"] else ""
    return (
        f"{made.error(reference)}; {speed['speedup']:.2g} times as fast as the full-order model "
        f"({speed['ms']:.3g} against {speed['full_ms']:.3g} ms a frame, timed in turn{busy})"
    )


COMMAND = Command(
    "Simulate a scene with the full-order model, or with a reduced model from pdrom train",
    "pdrom run sheet.yaml --out sheet.h5",
    {
        "scene": SCENE,
        "--model": text("MODEL", "reduced model from pdrom train"),
        "--compare": text("RUN.h5", "full-order run to compare the reduced run with"),
        "--from": text("RUN.h5", "run that is continued with this scene", dest="start"),
        "--frame": text("N", "with --from: frames of that run to keep (default: all)", type=int),
        "--out": text("FILE", "HDF5 file to write (default: SCENE.h5 or SCENE_MODEL.h5)"),
        "--check": flag("estimate the error of the run by a second run with more iterations"),
        "--no-estimate": flag("do not estimate the error of every 20th frame"),
        "--unchecked": UNCHECKED,
    },
    perform,
)
