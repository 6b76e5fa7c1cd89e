"""Total energy of a run, from its stored positions, relative to the full-order run."""

from dataclasses import dataclass, replace

import numpy as np

from pdrom.model.scene import Scene

# Energies are evaluated in every STRIDE-th frame, and in the last one.
STRIDE = 4


def energies(scene: Scene, positions: np.ndarray) -> np.ndarray:
    """Return total energies (n,), J, of a run: kinetic, of the constraints, and of the forces.

    positions : (F + 1, N, 3) m of a run of ``scene``, initial positions first. The velocities are
        (q_f - q_{f-1}) / h as in the step loop; the initial velocities come from the scene.

    The n energies are those of the initial state, every `STRIDE`-th frame and the last one. All
    projections are evaluated, also for reduced runs; with K iterations a frame this costs
    1 / (STRIDE K) of a run's local steps. The forces' potential is defined up to a constant.
    """
    frames = sorted({*range(0, len(positions), STRIDE), len(positions) - 1})
    scene = replace(scene, groups=[group.for_run() for group in scene.groups])
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array([_energy(scene, positions, frame) for frame in frames])


@dataclass(frozen=True)
class EnergyScale:
    """Reference for the energy of reduced runs, computed from the full-order run of a scene.

    The potential of the forces is measured from its smallest value in the full-order run, so that
    the total energy of this run is never negative.

    zero : smallest potential of the forces in the full-order run, J
    peak : largest total energy of the full-order run, J, minus ``zero``
    own : (`energies` of this run - ``zero``) / ``peak``; empty if ``peak`` is below rounding errors
    """

    scene: Scene
    zero: float
    peak: float
    own: np.ndarray

    @classmethod
    def of(cls, scene: Scene, reference: np.ndarray) -> "EnergyScale":
        """Return the scale of the full-order run ``reference`` (F + 1, N, 3) m of ``scene``."""
        zero = min(_force_potential(scene, q) for q in reference)
        own = energies(scene, reference) - zero
        peak, rest = float(own.max()), scene.mesh.points
        roundoff = sum(0.5 * float(g.weights.max()) * g.roundoff(rest) ** 2 for g in scene.groups)
        return cls(scene, zero, peak, own / peak if peak > roundoff else np.empty(0))

    def relative(self, positions: np.ndarray) -> np.ndarray:
        """Return (energies of a run - `zero`) / `peak`, from its ``positions`` (F' + 1, N, 3) m.

        The n values are those of every `STRIDE`-th frame and the last; inf if the energy overflows.
        A run with a value above one has gained energy that did not come from the initial state or
        the moving vertices of the full-order run. The result is empty (0,) if `own` is empty.
        """
        if not len(self.own):
            return self.own
        own = (energies(self.scene, positions) - self.zero) / self.peak
        return np.where(np.isfinite(own), own, np.inf)


def largest(energy: np.ndarray) -> float | None:
    """Return the largest of relative energies ``energy`` (n,); None if there are none."""
    return float(energy.max()) if len(energy) else None


def _energy(scene: Scene, positions: np.ndarray, frame: int) -> float:
    q = positions[frame]
    if frame == 0:
        v = scene.initial_state().velocities
    else:
        v = (q - positions[frame - 1]) / scene.config.time_step
    kinetic = 0.5 * float(scene.masses @ np.einsum("ij,ij->i", v, v))
    unused, potential = np.zeros_like(q), 0.0
    for group in scene.groups:
        group.begin_frame(q)  # computes data that are fixed during a frame, such as normals
        potential += group.accumulate(q, unused)
    return kinetic + potential + _force_potential(scene, q)


def _force_potential(scene: Scene, q: np.ndarray) -> float:
    return sum(force.potential(q, scene.masses) for force in scene.forces)
