"""Named checks of a run; each returns what is wrong ("" if nothing is).

A check gets the ``case``, its ``scene`` and the record of the full-order ``run``.
"""

from collections.abc import Callable

import numpy as np

from pdrom.core.errors import PdromError
from pdrom.model.metrics import shape_residuals
from pdrom.model.scene import Scene
from study.experiments.hard_cases.case import HardCase
from study.experiments.hard_cases.record import EPS, OPERATIONS, Record, full_order

Check = Callable[[HardCase, Scene, Record], str]

# A shape that came back to within this part of its extent is recovered.
RECOVERED = 1e-2


def finite(case: HardCase, scene: Scene, run: Record) -> str:
    """Every frame ran and is finite."""
    whole = len(run.positions) == scene.config.frames + 1
    return "" if whole else f"not finite in frame {run.blowup_frame}"


def bounded(case: HardCase, scene: Scene, run: Record) -> str:
    """The extent stays below the case's bound."""
    limit = case.bound * reach(scene, run)
    return "" if run.extent <= limit else f"extent {run.extent:.3g} m, allowed {limit:.3g} m"


def reach(scene: Scene, run: Record) -> float:
    """Largest extent of rest, start and held vertices, m."""
    sizes = [scene.mesh.extent, float(np.ptp(run.positions[0], axis=0).max())]
    held = np.unique(np.concatenate([[], *(b.vertices for b in scene.boundaries)]).astype(int))
    if len(held):
        sizes.append(float(np.ptp(run.positions[:, held], axis=1).max()))
    return max(sizes)


def objective(case: HardCase, scene: Scene, run: Record) -> str:
    """No iteration raises the objective by more than rounding explains."""
    worst = int(np.argmax(run.excess))
    if run.excess[worst] <= 0.0:
        return ""
    return f"objective rises by {run.rise[worst]:.1e} of its value in frame {worst}"


def energy(case: HardCase, scene: Scene, run: Record) -> str:
    """Kinetic energy plus that of the groups never exceeds its start.

    From rest the first frame obeys it for every K, since its objective is this energy; later
    frames by the damping of the implicit step.
    """
    start, largest = run.energy[0], run.energy.max()
    elastic = float(np.abs(run.positions).max()) ** 2 * float(abs(scene.system.matrix).sum())
    noise = EPS * OPERATIONS * elastic
    ok = largest <= start * (1.0 + 1e-9) + noise
    return "" if ok else f"energy grows from {start:.3g} J to {largest:.3g} J"


def momentum(case: HardCase, scene: Scene, run: Record) -> str:
    """Linear momentum changes by nothing but gravity."""
    h, masses = scene.config.time_step, scene.masses
    pull = sum((f.acceleration(run.positions[0], run.velocities[0]) for f in scene.forces), 0.0)
    frames = np.arange(len(run.velocities))[:, None]
    found = np.einsum("n,fna->fa", masses, run.velocities)
    expected = found[0] + frames * h * masses.sum() * np.broadcast_to(pull, 3)
    error = np.abs(found - expected).max()
    # the columns of S^T W p and of the solve's residual sum to zero up to rounding only
    size = float(np.abs(run.positions).max()) + float(np.abs(run.velocities).max()) * h
    noise = EPS * OPERATIONS * size * (masses.sum() / h + h * abs(scene.system.matrix).sum())
    allowed = noise * max(1.0, np.sqrt(len(found)))
    return (
        "" if error <= allowed else f"momentum is off by {error:.1e}, allowed {allowed:.1e} kg m/s"
    )


def determinism(case: HardCase, scene: Scene, run: Record) -> str:
    """A second run gives the same bits."""
    again = full_order(case, case.scene())
    same = np.array_equal(run.positions, again.positions)
    return "" if same and np.array_equal(run.rise, again.rise) else "a second run differs"


def recovers(case: HardCase, scene: Scene, run: Record) -> str:
    """The run ends in the rest shape, up to a rigid motion."""
    residuals, scale = shape_residuals(scene.mesh.points[None], run.positions[-1:])
    error = scale[0] * float(np.linalg.norm(residuals, axis=2).max()) / scene.mesh.extent
    return "" if error <= RECOVERED else f"ends {error:.2g} extents from its rest shape"


def still(case: HardCase, scene: Scene, run: Record) -> str:
    """Nothing moves."""
    moved = float(np.abs(run.positions - run.positions[0]).max())
    allowed = 1e-9 * float(np.abs(run.positions[0]).max())
    return "" if moved <= allowed else f"moves by {moved:.1e} m"


CHECKS: dict[str, Check] = {
    check.__name__: check
    for check in (
        finite,
        bounded,
        objective,
        energy,
        momentum,
        determinism,
        recovers,
        still,
    )
}


def refused(case: HardCase) -> str:
    """Building the scene, or its first frames, must raise a named error."""
    try:
        full_order(case, case.scene())
    except PdromError:
        return ""
    return "was not refused"


def faults(case: HardCase) -> list[str]:
    """List what does not hold in the full-order run of ``case``, empty if all does."""
    if case.holds == ("refused",):
        return [fault for fault in [refused(case)] if fault]
    scene = case.scene()
    run = full_order(case, scene)
    found = {name: CHECKS[name](case, scene, run) for name in case.holds}
    return [f"{name}: {fault}" for name, fault in found.items() if fault]
