"""Total energy of a run, from its stored positions, and how it compares with the full order."""

from dataclasses import dataclass

import numpy as np

from pdrom.model.scene import Scene

# The potential of the groups is evaluated at every so many frames, and at the last one.
STRIDE = 4


def energies(scene: Scene, positions: np.ndarray) -> np.ndarray:
    """Kinetic energy, potential of all groups and of all forces in joule, at sampled frames (n,).

    Parameters
    ----------
    positions : (F + 1, N, 3) m of a run of ``scene``, the initial ones first. Velocities are those
        of the step loop, (q_f - q_{f-1}) / h; the initial state brings its own.

    Every `STRIDE`-th frame, the first and the last are taken: a fraction 1 / (STRIDE K) of the
    local steps of the run. The projections are the full ones, whatever the run was made with. The
    potential of the forces has an arbitrary zero, so that only differences mean anything.
    """
    frames = sorted({*range(0, len(positions), STRIDE), len(positions) - 1})
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array([_energy(scene, positions, frame) for frame in frames])


@dataclass(frozen=True)
class EnergyScale:
    """Reference for the energy of reduced runs.

    The potential of the forces is counted from the least one that the full-order run reaches, so
    that its total energy is never negative.

    zero : that least potential, J
    peak : largest total energy of the full-order run, J, counted from there
    own : energies of that run at the sampled frames, see `relative`
    """

    scene: Scene
    zero: float
    peak: float
    own: np.ndarray

    @classmethod
    def of(cls, scene: Scene, reference: np.ndarray) -> "EnergyScale":
        """Scale of a full-order run of ``scene`` with positions ``reference`` (F + 1, N, 3) m."""
        zero = min(_force_potential(scene, q) for q in reference)
        own = energies(scene, reference) - zero
        peak, rest = float(own.max()), scene.mesh.points
        roundoff = sum(0.5 * float(g.weights.max()) * g.roundoff(rest) ** 2 for g in scene.groups)
        return cls(scene, zero, peak, own / peak if peak > roundoff else np.empty(0))

    def relative(self, positions: np.ndarray) -> np.ndarray:
        """Total energies at ``positions`` (F' + 1, N, 3) of a run, over the full order's largest.

        At the frames of `energies`; inf where one overflows. Empty if the full-order run has no
        energy above round-off to compare with.
        """
        if not len(self.own):
            return self.own
        own = (energies(self.scene, positions) - self.zero) / self.peak
        return np.where(np.isfinite(own), own, np.inf)

    def ratio(self, positions: np.ndarray) -> float | None:
        """Largest total energy at ``positions`` (F' + 1, N, 3) of a run, over the full order's.

        One for the full-order run itself. Above one, the run has gained energy that neither the
        initial state nor the handles brought into the full-order run. None if there is nothing to
        compare with, see `relative`.
        """
        return largest(self.relative(positions))


def largest(energy: np.ndarray) -> float | None:
    """Largest of the values ``energy`` (n,) of `EnergyScale.relative`, None if there are none."""
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
        group.begin_frame(q)  # frame-lagged data are taken at q itself
        potential += group.accumulate(q, unused)
    return kinetic + potential + _force_potential(scene, q)


def _force_potential(scene: Scene, q: np.ndarray) -> float:
    return sum(force.potential(q, scene.masses) for force in scene.forces)
