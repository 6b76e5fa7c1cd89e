"""Reach of a run that bounded projections can carry.

However many local/global iterations a frame has, its end obeys

    (M + h^2 K) q_{n+1} - M (1 + D) q_n + M D q_{n-1} = h^2 (S^T W p_n + f),    K = S^T W S,

with the projections p_n of the last iteration, held vertices eliminated. M are the masses, which
may differ, f the part of the forces that does not depend on the motion, and D = 1 - h c, |D| <= 1,
what forces -M c v leave of a velocity (see `study.experiments.kit.premise`). The p_n are
bounded (rest lengths, clamped singular values), and so is whatever replaces them linearly. Let e
be the difference of two runs whose projections differ by d_n, with F = S^T W d and

    reach  >=  | F_n |_{K^+}    for all n,

which is the size |e|_K = |S e|_W of the static answer to F. Then, as long as no contact acts,

* |e_n|_K <= sqrt(n) reach, whatever is pinned, released or moved meanwhile. With u = e_{n+1} - e_n
  the energy 1/2 |u|_M^2 + h^2/2 |e|_K^2 gains at most h^2 (u^T F - 1/2 |u|_K^2) in a frame, which
  is at most h^2/2 |F|_{K^+}^2; holding a vertex only takes energy out, and so does D;
* for ever |e_n|_K <= growth reach while the held vertices stay the same and D = 1. In the modes of
  (K, M) the recursion has the poles cos(t) exp(+-i t), tan t = h omega, inside the unit circle, and
  answers a unit static input by sin(t) cos(t)^m |sin((m+1) t)| after m frames; growth is the sum
  over m of the largest of them. One mode has at most cot(t / 2).

A mode with omega = 0 gets no force as long as D is a number. Two vertices are then apart by at most
|e|_K times the square root of their compliance (the effective resistance of the mesh between them).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.effects.held import held_vertices
from pdrom.model.scene import Scene

# Eigenvalues of a stiffness below this fraction of the largest one are zero.
ZERO = 1e-12
# Frames whose answers are summed one by one; the rest is bounded in closed form.
SUMMED = 20_000


def largest_projections(group: ConstraintGroup, points: np.ndarray) -> np.ndarray | None:
    """Bound (e,) of | p_e |_F over all states; None for a group that names no bounded manifold.

    Parameters
    ----------
    points : (N, 3) m, the rest shape
    """
    if group.manifold == "clamped":
        largest = float(group.kernel_parameters()[-1])
        return np.full(group.elements, np.sqrt(min(group.rows_per_element, 3)) * largest)
    if group.manifold in ("length", "half sphere"):
        rest = (group.S @ points).reshape(group.elements, -1)
        return np.linalg.norm(rest, axis=1)
    return None


def held_sets(scene: Scene) -> list[np.ndarray]:
    """Held vertices of ``scene``, ascending, in each stretch of frames with the same ones."""
    sets: list[np.ndarray] = []
    for frame in range(scene.config.frames):
        union = held_vertices(scene.boundaries, frame)
        if not sets or not np.array_equal(sets[-1], union):
            sets.append(union)
    return sets


def kept_velocity(scene: Scene) -> np.ndarray:
    """Factor of a frame of ``scene`` on a velocity, D = 1 - h c, (N,).

    ValueError for a force without rate.
    """
    rates = np.zeros(scene.mesh.vertices)
    for force in scene.forces:
        if force.rate is None:
            raise ValueError(f"the force '{force.name}' has no rate")
        rates += force.rate
    return 1.0 - scene.config.time_step * rates


@dataclass(frozen=True)
class Compliance:
    """Response of the stiffness and the masses of a scene to forces, see the module.

    inverse : (N, N) m/N, a generalised inverse of K: the sum of x x^T / omega^2 over the modes x,
        |x|_M = 1, omega > 0, with the held vertices eliminated if they are always the same ones;
        without elimination otherwise
    growth : factor of |e|_K over the frames of the scene
    lasting : the same for ever, with the vertices that are held last; inf if none is proved
    bounded : whether vertices that nothing connects cannot move apart
    """

    inverse: np.ndarray
    growth: float
    lasting: float
    bounded: bool

    @classmethod
    def of(cls, scene: Scene) -> "Compliance":
        """Compliance of a scene (dense: N of a few thousand at most)."""
        stiffness = sum(g.system_matrix() for g in scene.groups).toarray()
        sets, frames, kept = held_sets(scene), scene.config.frames, kept_velocity(scene)
        always, everything = len(sets) == 1, np.arange(len(stiffness))
        free = np.setdiff1d(everything, sets[-1])
        last = _Modes.of(stiffness, scene.masses, free)
        modes = last if always else _Modes.of(stiffness, scene.masses, everything)
        growth, lasting = np.sqrt(frames), np.inf
        if last.resolved and (kept == 1.0).all():
            angles = np.arctan(scene.config.time_step * np.sqrt(last.squares))
            lasting = _growth(angles, None)
            if always:
                growth = min(growth, _growth(angles, frames))
        # what no element resists gets no force, unless holds change or rates differ; then it may
        # drift, and only a translation of all vertices takes none apart
        loose = len(modes.free) - len(modes.squares)
        together = loose == 0 or (loose == 1 and len(modes.free) == len(everything))
        bounded = modes.resolved and (together or (always and np.ptp(kept) == 0.0))
        return cls(modes.inverse, float(growth), lasting, bool(bounded))

    @cached_property
    def softest(self) -> float:
        """Largest compliance between two vertices, m/N; inf where two may drift apart."""
        if not self.bounded:
            return np.inf
        own = np.diag(self.inverse)
        return float((own[:, None] + own[None, :] - 2.0 * self.inverse).max())


@dataclass(frozen=True)
class _Modes:
    """Modes of (K, M) of the ``free`` vertices (n,) that are not motions without force.

    squares : (k,) omega^2, 1/s^2
    inverse : (N, N), see `Compliance`
    resolved : whether K has as many; masses that are too far apart bury the slowest in round-off
    """

    free: np.ndarray
    squares: np.ndarray
    inverse: np.ndarray
    resolved: bool

    @classmethod
    def of(cls, stiffness: np.ndarray, masses: np.ndarray, free: np.ndarray) -> "_Modes":
        """Modes of a stiffness (N, N) with masses (N,)."""
        inverse, block = np.zeros_like(stiffness), stiffness[np.ix_(free, free)]
        if len(free) == 0:
            return cls(free, np.empty(0), inverse, True)
        root = 1.0 / np.sqrt(masses[free])
        values, vectors = linalg.eigh(root[:, None] * block * root)
        kept = _positive(values)
        modes = root[:, None] * vectors[:, kept]
        inverse[np.ix_(free, free)] = (modes / values[kept]) @ modes.T
        rank = np.count_nonzero(_positive(linalg.eigvalsh(block)))
        return cls(free, values[kept], inverse, bool(kept.sum() == rank))


def _positive(values: np.ndarray) -> np.ndarray:
    """Mark those of the ascending eigenvalues (n,) of a stiffness that are not zero."""
    return values > ZERO * values[-1]


def _growth(angles: np.ndarray, frames: int | None) -> float:
    """Sum of the largest answers of the modes after m = 0, 1, ... frames; None: of all m."""
    if len(angles) == 0:
        return 0.0
    c, s = np.cos(angles), np.sin(angles)
    total, power = 0.0, s.copy()
    softest = int(np.argmin(s))
    # from this m on the softest mode has the largest bound sin(t) cos(t)^m
    alone = float(np.ceil((c[softest] / s[softest]) ** 2))
    summed = int(min(alone if frames is None else frames, SUMMED))
    for m in range(summed):
        total += float(np.max(power * np.abs(np.sin((m + 1) * angles))))
        power *= c
    if frames is None:
        # beyond, the largest over all angles is below m^-1/2 until the softest mode takes over
        total += 2.0 * max(np.sqrt(alone) - np.sqrt(summed), 0.0)
        rest = 2.0 * np.sin(0.5 * angles[softest]) ** 2  # 1 - cos(t), which may cancel
        total += float(s[softest] * c[softest] ** alone / rest)
    elif frames > summed:
        total = np.inf
    return total


class ConstantProjections:
    """A local step whose projections never change: S^T W p, (N, 3) N."""

    def __init__(self, name: str, force: np.ndarray) -> None:
        self.name, self._force = name, force

    def begin_frame(self, q: np.ndarray) -> None:
        """Do nothing with the positions ``q`` (N, 3) m: nothing depends on the frame."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the force to ``rhs`` (N, 3) N, whatever ``y`` is; the energy is unknown: nan."""
        rhs += self._force
        return float("nan")


def linear_extent(scene: Scene, force: np.ndarray) -> float:
    """Largest extent, in rest extents, of the scene's run with constant projections, no contact.

    Parameters
    ----------
    force : (N, 3) N, S^T W p of all groups
    """
    space = VertexSpace(scene.system, scene.forces, scene.boundaries)
    steps = [ConstantProjections("constant", force)]
    loop = Stepper(space, scene.config.time_step, 1, local_steps=steps, track_objective=False)
    state: State = scene.initial_state()
    largest = float(np.ptp(state.positions, axis=0).max())
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
        largest = max(largest, float(np.ptp(state.positions, axis=0).max()))
    return largest / scene.mesh.extent
