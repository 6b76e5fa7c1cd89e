"""``pdrom reduce SCENE.yaml --error E``: a run that keeps to an error."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import Status, require_output

if TYPE_CHECKING:
    from pdrom.api import AskedRun

# Options of a single group.
OF_A_GROUP = ("guard", "alarm", "threshold", "plot")


def perform_asked(arguments: argparse.Namespace) -> Status:
    """Choose on the training run, run, and say what was done and what it cost."""
    from pdrom.api import FullRun, load, load_scene, reduce, save
    from pdrom.core.errors import ConfigurationError, StorageError
    from pdrom.reduction.asked.ask import read_ask

    scene = load_scene(arguments.scene)
    wish, source = arguments.error, "--error"
    if wish is None:
        wish, source = scene.config.asked, f"{arguments.scene}: reduce.error"
    if wish is None:
        raise ConfigurationError(
            "--group or --error: one is required (or reduce.error in the scene)"
        )
    ask = read_ask(wish, source)
    for option in OF_A_GROUP:
        if getattr(arguments, option) is not None:
            raise ConfigurationError(f"--{option}: only together with --group")
    if not arguments.run:
        raise ConfigurationError(
            f"{source}: --run is required with it: a training run, which pdrom run makes"
        )
    out = arguments.out or str(
        Path(arguments.scene).with_name(f"{Path(arguments.scene).stem}_asked.h5")
    )
    require_output(out, [arguments.scene, arguments.run])
    full = load(arguments.run, arguments.unchecked)
    if not isinstance(full, FullRun):
        raise StorageError(f"{arguments.run}: no full-order run (pdrom run makes one)")
    asked = reduce(full, error=ask, scene=scene)
    save(asked, out)
    sys.stdout.write("\n".join([f"{out}: {_promise(asked)}", *_done(asked)]) + "\n")
    return Status.DONE if asked.outcome.promised else Status.NOTHING_FITS


def _promise(asked: "AskedRun") -> str:
    import numpy as np

    outcome, wish = asked.outcome, f"{asked.ask} against the converged implicit step"
    frames = len(outcome.positions) - 1
    if asked.horizon < frames:
        wish += f", up to frame {asked.horizon} (round-off decides after it)"
    if not np.isfinite(outcome.positions).all():
        return f"{wish}: blew up, with the full order, too"
    if not outcome.promised:
        return f"{wish}: nothing keeps to it for sure; run in full order as well as possible"
    return f"{wish}: kept, {'by a reduction' if outcome.reduced else 'by the full order only'}"


def _done(asked: "AskedRun") -> list[str]:
    """Steps, estimate and cost, a line each."""
    outcome, frames = asked.outcome, len(asked.ms)
    lines = [f"  from frame {frame}: {title}" for frame, title in outcome.changes]
    lines.append(
        f"  {outcome.reduced} of {frames} frames reduced, {len(outcome.checks)} checked, "
        f"{outcome.repairs} times gone back"
    )
    known = [f"expected at most {outcome.expected:.2g}"]
    if outcome.estimate is not None:
        known.append(f"estimated from the checks {outcome.estimate:.2g}")
    if asked.error is not None:
        known.append(f"reached {asked.error:.2g}")
    lines.append(f"  error: {', '.join(known)}")
    lines.append(
        f"  {asked.ms[0]:.2f} ms a frame, about {outcome.work / outcome.full_work:.2f} of the full "
        f"order that keeps to it; {asked.offline_s:.1f} s to choose"
    )
    return lines
