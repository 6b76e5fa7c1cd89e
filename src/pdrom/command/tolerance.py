"""``pdrom reduce SCENE.yaml --error E``: a run within a requested tolerance."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import Status, files_of, require_output

if TYPE_CHECKING:
    from pdrom.api import AskedRun


def perform_request(arguments: argparse.Namespace) -> Status:
    """Calibrate on the training run, run, and say what was done and what it cost."""
    from pdrom.api import FullRun, load, load_scene, reduce, save
    from pdrom.command.progress import WorkProgress
    from pdrom.core.errors import ConfigurationError, StorageError
    from pdrom.reduction.requested.calibration import read_request

    scene = load_scene(arguments.scene)
    wish, source = arguments.error, "--error"
    if wish is None:
        wish, source = scene.config.asked, f"{arguments.scene}: reduce.error"
    if wish is None:
        raise ConfigurationError(
            "--group or --error: one is required (or reduce.error in the scene)"
        )
    request = read_request(wish, source)
    if arguments.plot is not None:
        raise ConfigurationError("--plot: only together with --group")
    if not arguments.run:
        raise ConfigurationError(
            f"{source}: --run is required with it: a training run, which pdrom run makes"
        )
    stem = Path(arguments.scene).stem
    out = arguments.out or str(Path(arguments.scene).with_name(f"{stem}_asked.h5"))
    require_output(out, [*files_of(arguments.scene, scene), arguments.run])
    full = load(arguments.run, arguments.unchecked)
    if not isinstance(full, FullRun):
        raise StorageError(f"{arguments.run}: no full-order run (pdrom run makes one)")
    with WorkProgress(scene.config.name) as progress:
        made = reduce(full, error=request, scene=scene, on_work=progress)
    save(made, out)
    sys.stdout.write("\n".join([f"{out}: {_answer(made)}", *_done(made)]) + "\n")
    return status_of(made)


def status_of(made: "AskedRun") -> Status:
    """Exit code: the tolerance has to be met for half of the frames at least."""
    return Status.DONE if 2 * made.outcome.frames >= len(made.ms) else Status.NOTHING_FITS


def _answer(made: "AskedRun") -> str:
    import numpy as np

    outcome, frames = made.outcome, len(made.ms)
    wish = f"{made.request} against the converged implicit step"
    if not np.isfinite(outcome.positions).all():
        return f"{wish}: blew up, with the full order, too"
    if not outcome.met:
        why = outcome.limit or "nothing meets it for sure"
        return f"{wish}: refused ({why}); run in full order with the most iterations"
    maker = "by a reduction" if outcome.reduced else "by the full order only"
    part = "" if outcome.frames == frames else f" up to frame {outcome.frames} of {frames}"
    return f"{wish}: met{part}, {maker}" + (f" ({outcome.limit})" if part else "")


def _done(made: "AskedRun") -> list[str]:
    """Level, estimate and cost, a line each."""
    outcome, ms = made.outcome, made.ms[0]
    tried = f", after {', '.join(outcome.failed)}" if outcome.failed else ""
    known = [f"expected at most {outcome.expected:.2g}"]
    if outcome.estimate is not None:
        known.append(f"estimated {outcome.estimate:.2g}")
    if made.error is not None:
        known.append(f"reached {made.error:.2g}")
    return [
        f"  by {outcome.level}{tried}; {len(outcome.checks)} frames checked",
        f"  error: {', '.join(known)}",
        f"  {ms:.2f} ms a frame, about {outcome.work / outcome.full_work:.2f} of the full order "
        f"that meets it; choosing took {made.offline_s:.1f} s, as long as "
        f"{1e3 * made.offline_s / ms:.0f} frames",
    ]
